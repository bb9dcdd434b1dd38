"""A whole campaign over a CAN bus in real time: design, run at 200 cycles a second in a process of its own, identify.

What the loop or a drive missed is counted and left out, and nothing is missing unsaid; what comes out is what was put
into the emulated arm.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import assert_within, deviations, six_joints, three_joints
from hardware_emulated.canopen_rig import ANSWER_PATIENCE_S
from hardware_emulated.canopen_robot import GEAR, write_canopen_arm
from hardware_emulated.counted import against_the_clock, require_all_counted
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.identification import document, identify
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.record import RunRecord
from tauscope.runtime.run_process import RunProcess
from tauscope.trajectory import Trajectory, write_trajectory
from tauscope_sim.canopen_bus.emulator import CanOrder

RATE_HZ = 200.0
TORQUE_NOISE = 0.5
"""As the seed paper has it [Nm]."""

FARTHEST = 4.0
"""From the truth, in standard errors: where a parameter is farther off, the arm is played once more."""
MOST_RMS = 2.0
"""Of all deviations, in standard errors: that messages come late by what nobody knows makes it 0.9 to 1.3."""

DESIGN = ExcitationOptions(period_s=8.0, periods=1, starts=1, slow_postures=1)
ARMS: dict[str, Callable[[], dict[str, Any]]] = {"three": three_joints, "six": six_joints}


def play(arm: dict[str, Any], folder: Path) -> RunRecord:
    """Design a motion for an arm and run it on emulated drives, each of the two programs in its own process."""
    path = write_canopen_arm(arm, folder / "arm.json", folder / "port")
    robot = read_robot(path)
    motion: Trajectory = design_excitation(robot, DESIGN).trajectory
    write_trajectory(motion, folder / "motion.json")
    order = CanOrder(
        robot=str(path),
        start=tuple((motion.start + 0.05).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        # half the torque limit, at the motor
        rated_torque_mnm=tuple(round(500.0 * (joint.limits.torque or 0.0) / GEAR) for joint in robot.joints),
        torque_noise=TORQUE_NOISE,
    )
    run = RunOrder(
        robot=str(path),
        trajectory=str(folder / "motion.json"),
        backend=BackendOrder(name="canopen", settings={"patience_s": ANSWER_PATIENCE_S}),
        options=RunOptions(rate_hz=RATE_HZ, watchdog_s=0.4, following_error=1.0, missed=20, lost_s=0.3, least_kept=0.0),
    )
    with EmulatorProcess(order):
        return RunProcess(folder / "run", run, robot).wait(100.0)


def campaign(arm: dict[str, Any], folder: Path) -> dict[str, float]:
    """Play and identify; how far every parameter is from the truth, in its standard errors."""
    folder.mkdir()
    record = play(arm, folder)
    with against_the_clock(record):
        require_all_counted(record, folder / "run", RATE_HZ)
        told = read_robot(write_canopen_arm(arm, folder / "told.json", folder / "unused", knows_model=False))
        found = document(identify(told, [read_recording(folder / "run" / "recording.csv")]))
        assert len(found.base_parameters) >= 3 * len(arm["joints"])
        far = deviations(found, read_robot(folder / "arm.json"))
        print(f"largest deviation {max(map(abs, far.values())):.2f} standard errors of {len(far)}")
        assert np.linalg.norm(list(far.values())) < MOST_RMS * np.sqrt(len(far))
        return far


@pytest.mark.realtime
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ["three", pytest.param("six", marks=pytest.mark.proof)])
def test_a_campaign_at_200_hz(name: str, tmp_path: Path) -> None:
    """One of dozens of parameters may be far off by chance: then the arm is played again, and none may be that time."""
    far = campaign(ARMS[name](), tmp_path / "first")
    if max(map(abs, far.values())) >= FARTHEST:
        far = campaign(ARMS[name](), tmp_path / "again")
    assert_within(FARTHEST, far)
