"""Every fault of the kit in every phase of a run on a CAN bus: how it ends, what is said, what is kept.

The table in docs/ is this; run with ``TAUSCOPE_WRITE_DOCS=1`` to renew it. The drives' time passes in step with the
host's cycles, so that the table is the same on every machine.
"""

from pathlib import Path

import pytest

from drivers.canopen import CanopenArm, DriveJoint
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.canopen_robot import GEAR, write_canopen_arm
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
from service.excitation import ExcitationOptions, design_excitation
from service.robot import read_robot
from shared_data import REPOSITORY
from sim_backend.canopen_bus.order import CanOrder
from sim_backend.emulation import EmulatorProcess, FaultKind, InjectedFault

TABLE = REPOSITORY / "docs" / "reference" / "canopen-faults.md"
NODE = 2

FAULTS = {
    FaultKind.LOSE: (InjectedFault(FaultKind.LOSE, NODE, count=2), "two frames are lost in the adapter"),
    FaultKind.CORRUPT: (InjectedFault(FaultKind.CORRUPT, NODE, count=2), "two frames are disturbed and sent again"),
    FaultKind.LATE: (InjectedFault(FaultKind.LATE, NODE, count=2, seconds=0.06), "two frames are 60 ms late"),
    FaultKind.DUPLICATE: (InjectedFault(FaultKind.DUPLICATE, NODE, count=5), "five frames arrive twice"),
    FaultKind.SILENT: (InjectedFault(FaultKind.SILENT, NODE, seconds=30.0), "the node falls silent"),
    FaultKind.BUS_OFF: (InjectedFault(FaultKind.BUS_OFF, NODE, seconds=0.3), "the node is off the bus for 0.3 s"),
    FaultKind.OVER_TEMPERATURE: (InjectedFault(FaultKind.OVER_TEMPERATURE, NODE), "the drive is too hot"),
    FaultKind.OVERLOAD: (InjectedFault(FaultKind.OVERLOAD, NODE), "the drive is overloaded"),
    FaultKind.ENCODER_JUMP: (
        InjectedFault(FaultKind.ENCODER_JUMP, NODE, counts=260_000),
        "its encoder jumps by 0.5 rad",
    ),
    FaultKind.RESET: (InjectedFault(FaultKind.RESET, NODE, seconds=0.3), "the drive restarts"),
    FaultKind.POWER_DIP: (InjectedFault(FaultKind.POWER_DIP, seconds=0.3), "the power of all dips"),
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("faults")
    robot = read_robot(write_canopen_arm(three_joints(), folder / "arm.json", folder / "port"))
    design = ExcitationOptions(period_s=2.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    order = CanOrder(
        robot=str(folder / "arm.json"),
        start=tuple((motion.start + 0.1).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        rated_torque_mnm=(1000, 1000, 800),
        stepped=True,
    )
    with EmulatorProcess(order) as emulator:
        yield Site(emulator, robot, motion, folder)


def run(site: Site, kind: FaultKind, phase: str) -> tuple[RunRecord, Path]:
    site.emulator.reset()
    joints = [DriveJoint(joint.name, GEAR, joint.drive or {}) for joint in site.robot.joints]
    arm = CanopenArm(joints, patience_s=0.1, clock=SteppedClock(site.emulator))
    disturbed = Disturbed(arm, phase, lambda: site.emulator.inject(FAULTS[kind][0]))
    return site.run(disturbed, f"{kind}-{phase}", "canopen")


def table(outcomes: dict[str, dict[str, Outcome]]) -> str:
    lines = [
        "# Faults of a CAN bus, phase by phase",
        "",
        "Made by `tests/hardware_emulated/test_canopen_fault_table.py` on three emulated CiA 402 drives; node 2 has",
        "the fault just as the phase begins. `TAUSCOPE_WRITE_DOCS=1` renews it. What real drives do may differ where",
        "the emulator had to assume something: see the README on what only hardware can show.",
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


QUICK = [
    (FaultKind.OVERLOAD, "run", "overload"),
    (FaultKind.LOSE, "run", ""),
    (FaultKind.BUS_OFF, "run", "stale-state"),
]


@pytest.mark.parametrize(("kind", "phase", "reason"), QUICK)
def test_some_faults_in_some_phases(site: Site, kind: FaultKind, phase: str, reason: str) -> None:
    found = outcome(run(site, kind, phase)[0])
    assert found.end == ("failed" if reason else "finished")
    assert found.reason == reason
