"""Every fault of the kit in every phase of a run: how it ends, what is said, what is kept. The table in docs/ is this.

Run with ``TAUSCOPE_WRITE_DOCS=1`` to renew the table. The servos' time passes in step with the host's cycles, so that
the table is the same on every machine.
"""

from pathlib import Path

import pytest

from drivers.dynamixel import DynamixelArm
from hardware_emulated.campaign_arms import three_joints, write_robot
from hardware_emulated.fault_runs import (
    PHASES,
    Disturbed,
    Outcome,
    Site,
    outcome,
    require_definite,
    require_documented,
    table_lines,
)
from hardware_emulated.stepped_clock import SteppedClock
from service.acquisition import RunRecord
from service.acquisition.dynamixel_bus import dynamixel_joints
from service.excitation import ExcitationOptions, design_excitation
from service.robot import read_robot
from shared_data import REPOSITORY
from sim_backend.dynamixel_bus import DynamixelOrder
from sim_backend.dynamixel_bus.robot_servos import servos_of
from sim_backend.emulation import EmulatorProcess, FaultKind, InjectedFault

TABLE = REPOSITORY / "docs" / "reference" / "dynamixel-faults.md"
SERVO = 2

FAULTS = {
    FaultKind.LOSE: (InjectedFault(FaultKind.LOSE, SERVO, count=2), "two answers are lost"),
    FaultKind.CORRUPT: (InjectedFault(FaultKind.CORRUPT, SERVO, count=2), "two answers arrive damaged"),
    FaultKind.LATE: (InjectedFault(FaultKind.LATE, SERVO, count=2, seconds=0.06), "two answers are 60 ms late"),
    FaultKind.DUPLICATE: (InjectedFault(FaultKind.DUPLICATE, SERVO, count=5), "five answers arrive twice"),
    FaultKind.SILENT: (InjectedFault(FaultKind.SILENT, SERVO, seconds=30.0), "the servo falls silent"),
    FaultKind.OVER_TEMPERATURE: (InjectedFault(FaultKind.OVER_TEMPERATURE, SERVO), "the servo is too hot"),
    FaultKind.OVERLOAD: (InjectedFault(FaultKind.OVERLOAD, SERVO), "the servo is overloaded"),
    FaultKind.ENCODER_JUMP: (
        InjectedFault(FaultKind.ENCODER_JUMP, SERVO, counts=80_000),
        "its encoder jumps by 0.5 rad",
    ),
    FaultKind.RESET: (InjectedFault(FaultKind.RESET, SERVO, seconds=0.3), "the servo restarts"),
    FaultKind.POWER_DIP: (InjectedFault(FaultKind.POWER_DIP, seconds=0.3), "the power of all dips"),
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("faults")
    robot = read_robot(write_robot(three_joints(), folder / "arm.json", str(folder / "port")))
    design = ExcitationOptions(period_s=2.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    order = DynamixelOrder(
        servos=servos_of(robot),
        start=tuple((motion.start + 0.1).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        robot=str(folder / "arm.json"),
        stepped=True,
    )
    with EmulatorProcess(order) as emulator:
        yield Site(emulator, robot, motion, folder)


def run(site: Site, kind: FaultKind, phase: str) -> tuple[RunRecord, Path]:
    site.emulator.reset()
    arm = DynamixelArm(dynamixel_joints(site.robot), slack_s=0.1, clock=SteppedClock(site.emulator))
    disturbed = Disturbed(arm, phase, lambda: site.emulator.inject(FAULTS[kind][0]))
    return site.run(disturbed, f"{kind}-{phase}", "dynamixel")


def table(outcomes: dict[str, dict[str, Outcome]]) -> str:
    lines = [
        "# Faults of a Dynamixel bus, phase by phase",
        "",
        "Made by `tests/hardware_emulated/test_dynamixel_fault_table.py` on three emulated servos; servo 2 has the",
        "fault just as the phase begins. `TAUSCOPE_WRITE_DOCS=1` renews it. What real servos do may differ where the",
        "emulator had to assume something: see the README on what only hardware can show.",
        "",
    ]
    return "\n".join(lines + table_lines(outcomes)) + "\n"


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_fault_in_every_phase(site: Site) -> None:
    outcomes = {
        name: {phase: require_definite(kind, phase, *run(site, kind, phase)) for phase in PHASES}
        for kind, (_, name) in FAULTS.items()
    }
    require_documented(TABLE, table(outcomes))


QUICK = [(FaultKind.OVERLOAD, "run", "overload"), (FaultKind.SILENT, "stop", "silent"), (FaultKind.LOSE, "run", "")]


@pytest.mark.parametrize(("kind", "phase", "reason"), QUICK)
def test_some_faults_in_some_phases(site: Site, kind: FaultKind, phase: str, reason: str) -> None:
    found = outcome(run(site, kind, phase)[0])
    assert found.end == ("failed" if reason else "finished")
    assert found.reason == reason
