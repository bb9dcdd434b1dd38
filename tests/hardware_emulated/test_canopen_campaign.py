"""A whole campaign over a CAN bus: design, run, identify; what comes out is what was put into the emulated arm.

Frames go as an adapter's text over a pseudo terminal to drives in a process of their own, whose time passes in step
with the host's cycles: what a busy machine does to a run in real time is another test's matter.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import assert_within, deviations, six_joints, three_joints
from hardware_emulated.canopen_robot import GEAR, drive_joints, write_canopen_arm
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.identification import document, identify
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope.runtime.drivers import Connection
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_sim.canopen_bus.emulator import CanOrder
from tauscope_sim.emulation import FaultKind, InjectedFault

TORQUE_NOISE = 0.5
"""As the seed paper has it [Nm]."""

RATE_HZ = 200.0
DESIGN = ExcitationOptions(period_s=8.0, periods=2, starts=2, slow_postures=2)
ARMS: dict[str, Callable[[], dict[str, Any]]] = {"three": three_joints, "six": six_joints}


def play(arm: dict[str, Any], folder: Path, faults: list[InjectedFault], design: ExcitationOptions) -> RunRecord:
    """Design a motion for an arm and run it on emulated drives."""
    robot = read_robot(write_canopen_arm(arm, folder / "arm.json", folder / "port"))
    motion = design_excitation(robot, design).trajectory
    order = CanOrder(
        robot=str(folder / "arm.json"),
        start=tuple((motion.start + 0.1).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        # half the torque limit, at the motor
        rated_torque_mnm=tuple(round(500.0 * (joint.limits.torque or 0.0) / GEAR) for joint in robot.joints),
        torque_noise=TORQUE_NOISE,
        stepped=True,
    )
    with EmulatorProcess(order) as emulator:
        backend = CanopenArm(drive_joints(robot), patience_s=0.5, clock=SteppedClock(emulator))
        emulator.inject(*faults)
        return run_trajectory(
            robot,
            motion,
            lambda: Connection(backend, is_real_time=False),
            folder / "run",
            RunOptions(rate_hz=RATE_HZ),
            backend_name="canopen",
        )


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ["three", pytest.param("six", marks=pytest.mark.proof)])
def test_parameters_are_found_within_their_errors(name: str, tmp_path: Path) -> None:
    arm = ARMS[name]()
    lost = [InjectedFault(FaultKind.LOSE, device=2, at_s=at_s, count=2) for at_s in (5.0, 12.0, 19.0)]
    record = play(arm, tmp_path, lost, DESIGN)
    assert record.state is RunState.FINISHED, record.problem
    assert record.timing is not None
    assert record.timing.missed_periods == 0
    recording = read_recording(tmp_path / "run" / "recording.csv")
    missed = np.isnan(recording.samples().position).sum(axis=0)
    assert missed[1] >= 3, "samples that a drive did not answer are marked"
    assert missed[1] <= record.timing.stale_samples[1], "and counted"
    told = read_robot(write_canopen_arm(arm, tmp_path / "told.json", tmp_path / "unused", knows_model=False))
    found = document(identify(told, [recording]))
    far = deviations(found, read_robot(tmp_path / "arm.json"))
    assert_within(4.0, far)
    assert len(found.base_parameters) >= 3 * len(arm["joints"])
