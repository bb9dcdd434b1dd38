"""Six joints at 200 cycles a second in real time: what the loop missed is counted, and nothing is missing unsaid."""

from pathlib import Path

import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import six_joints
from hardware_emulated.counted import against_the_clock, require_all_counted
from hardware_emulated.servo_bench import SLACK_S
from hardware_emulated.servo_kinds import KINDS, ServoKind
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import read_robot
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.run_process import RunProcess
from tauscope.trajectory import write_trajectory

pytestmark = pytest.mark.realtime

RATE_HZ = 200.0
"""The bus of STS3215 servos carries 224 Hz."""


@KINDS
def test_six_joints_at_200_hz(kind: ServoKind, tmp_path: Path) -> None:
    path = kind.write_robot(six_joints(), tmp_path / "arm.json", str(tmp_path / "port"))
    robot = read_robot(path)
    design = ExcitationOptions(period_s=8.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    write_trajectory(motion, tmp_path / "motion.json")
    # Pendulums in place of links: the physics of six links take a third of a processor.
    order = kind.order(robot, (motion.start + 0.05).tolist(), tmp_path, quick=True)
    run = RunOrder(
        robot=str(path),
        trajectory=str(tmp_path / "motion.json"),
        backend=BackendOrder(name=kind.name, settings={"patience_s": SLACK_S}),
        options=RunOptions(rate_hz=RATE_HZ, watchdog_s=0.4, following_error=1.0, missed=20, lost_s=0.3, least_kept=0.0),
    )
    with EmulatorProcess(order):
        record = RunProcess(tmp_path / "run", run, robot).wait(100.0)
    with against_the_clock(record):
        require_all_counted(record, tmp_path / "run", RATE_HZ)
