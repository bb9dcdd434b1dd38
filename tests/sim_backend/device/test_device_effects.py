"""The drives stay stable and accurate on arms that conceal what drives find hardest."""

import numpy as np
import pytest

from arm_rigs import START, VirtualRig, bench_robot, drive, enable, setpoint, wide_limits
from tauscope.robot.robot import Robot
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.scenario_file import scenario_from_yaml

ENTRIES = {
    "elastic joint": "{effect: joint_elasticity, joint: 2, stiffness: 5000, damping: 1, rotor_inertia: 0.05}",
    "backlash": "{effect: backlash, joint: 2, gap: 0.005, contact_stiffness: 20000, rotor_inertia: 0.05}",
    "heavy rotor": "{effect: rotor_inertia, joint: 3, inertia: 1.0}",
    "bristles": "{effect: presliding_hysteresis, joint: 2, distance: 0.002}",
    "payload that is dropped": "{effect: payload_change, mass: 0.3, start: 0.0, end: 1.0}",
}


def concealing(robot: Robot, entry: str, start: np.ndarray) -> SimulatedArm:
    scenario = scenario_from_yaml(f"effects:\n  - {entry}\n".encode(), "scenario", robot)
    return SimulatedArm(robot, scenario, start_position=start)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ENTRIES))
def test_a_motion_is_tracked(name: str) -> None:
    robot = bench_robot()
    motion = random_fourier_motion(robot.joints, np.random.default_rng(5), period_s=4.0, harmonics=3)
    time = np.arange(800) / 400.0
    asked = motion.evaluate(time).position
    arm = concealing(robot, ENTRIES[name], asked[0])
    arm.connect()
    arm.enable(ControlMode.POSITION, wide_limits(robot), StopPolicy.HOLD, 0.1)
    errors, efforts = [], []
    for t, position in zip(time, asked, strict=True):
        arm.clock.wait_until_ns(round(t * 1e9))
        state = arm.exchange(setpoint(position))
        errors.append(state.position - motion.evaluate(np.array([state.time_ns * 1e-9 - 2.0 / 400.0])).position[0])
        efforts.append(state.effort)
    assert not state.faults
    assert np.abs(errors[100:]).max() < 0.015
    # a drive that vibrates turns its torque about at every sample
    assert np.diff(efforts, 2, axis=0)[100:].std() < 0.5


@pytest.mark.parametrize("name", ["elastic joint", "backlash", "bristles"])
def test_an_arm_at_rest_does_not_vibrate(name: str) -> None:
    arm = concealing(bench_robot(), ENTRIES[name], START)
    rig = VirtualRig(arm)
    enable(rig, watchdog_s=5.0)
    states = drive(rig, lambda _: setpoint(START), 0.4)
    efforts = np.array([state.effort for state in states])[50:]
    assert np.diff(efforts, axis=0).std() < 0.02
    assert np.abs(states[-1].position - START).max() < 2e-3
