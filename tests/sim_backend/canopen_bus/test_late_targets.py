"""Targets that reach emulated drives late, and several at once: a busy machine does that to them, never a real bus."""

from typing import cast

import numpy as np
import pytest

from hardware_emulated.campaign_arms import six_joints
from tauscope.robot import Robot, robot_from_dict
from tauscope_sim.canopen_bus.drive import AxisDemand, AxisMode, EmulatedDrive
from tauscope_sim.canopen_bus.driven_arm import FASTEST, DrivenArm
from tauscope_sim.emulation.emulator import STEP_S
from tauscope_sim.scenario import Scenario

CYCLE = 5
"""Steps between two targets."""


class FollowingDrive:
    """A drive in operation that knows nothing but its target."""

    def __init__(self, torque_cap: float) -> None:
        self.target = 0.0
        self._torque_cap = torque_cap

    def demand(self) -> AxisDemand:
        return AxisDemand(AxisMode.POSITION, self.target, 0.0, self._torque_cap, CYCLE * STEP_S)

    def measure(self, position: float, velocity: float, torque: float) -> None:
        pass


def motion(time_s: float, robot: Robot) -> np.ndarray:
    """Each joint swings at its speed limit and half its acceleration limit."""
    ways = np.array([(joint.limits.velocity or 0.0, joint.limits.acceleration or 0.0) for joint in robot.joints])
    rate = 0.5 * ways[:, 1] / ways[:, 0]
    return ways[:, 0] / rate * (1.0 - np.cos(rate * time_s))


@pytest.mark.parametrize("targets_at_once", [1, 8])
def test_no_joint_runs_away_where_targets_come_several_at_once(targets_at_once: int) -> None:
    robot = robot_from_dict(six_joints())
    drives = [FollowingDrive(joint.limits.torque or 0.0) for joint in robot.joints]
    driven = DrivenArm(cast(list[EmulatedDrive], drives), robot, Scenario(), np.zeros(6), STEP_S)
    driven.stands_on_stand = False
    fastest = np.zeros(6)
    for tick in range(1500):
        if tick % (CYCLE * targets_at_once) == 0:
            for cycle in range(targets_at_once):
                place = motion((tick - CYCLE * (targets_at_once - cycle)) * STEP_S, robot)
                for drive, target in zip(drives, place, strict=True):
                    drive.target = float(target)
                driven.take_targets(tick * STEP_S)
        driven.step(tick)
        fastest = np.maximum(fastest, np.abs(driven.motion[1]))
    limit = np.array([joint.limits.velocity or 0.0 for joint in robot.joints])
    assert np.all(fastest < 1.1 * FASTEST * limit)
