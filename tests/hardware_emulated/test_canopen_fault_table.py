"""Every fault of the kit in every phase of a run on a CAN bus: how it ends, what is said, what is kept.

The table in docs/ is this; run with ``TAUSCOPE_WRITE_DOCS=1`` to renew it. The drives' time passes in step with the
host's cycles, so that the table is the same on every machine.
"""

from collections.abc import Iterator

import pytest

from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.canopen_robot import drive_joints, write_canopen_arm
from hardware_emulated.fault_runs import Site, fault_site
from hardware_emulated.fault_table import FaultTable
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.robot import Robot
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_sim.canopen_bus.emulator import CanOrder
from tauscope_sim.emulation import FaultKind


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("faults")
    robot_file = write_canopen_arm(three_joints(), folder / "arm.json", folder / "port")

    def order(_: Robot, start: tuple[float, ...]) -> CanOrder:
        port, control = str(folder / "port"), str(folder / "control")
        return CanOrder(
            robot=str(robot_file),
            start=start,
            port=port,
            control=control,
            rated_torque_mnm=(1000, 1000, 800),
            stepped=True,
        )

    with fault_site(robot_file, order) as one:
        yield one


def arm_of(site: Site) -> CanopenArm:
    return CanopenArm(drive_joints(site.robot), patience_s=0.1, clock=SteppedClock(site.emulator))


TABLE = FaultTable(
    bus="canopen",
    title="Faults of a CAN bus, phase by phase",
    arm_of=arm_of,
    devices="CiA 402 drives",
    device="node",
    half_radian=260_000,
    names={
        FaultKind.LOSE: "two frames are lost in the adapter",
        FaultKind.CORRUPT: "two frames are disturbed and sent again",
        FaultKind.LATE: "two frames are 60 ms late",
        FaultKind.DUPLICATE: "five frames arrive twice",
        FaultKind.SILENT: "the node falls silent",
        FaultKind.BUS_OFF: "the node is off the bus for 0.3 s",
        FaultKind.OVER_TEMPERATURE: "the drive is too hot",
        FaultKind.OVERLOAD: "the drive is overloaded",
        FaultKind.ENCODER_JUMP: "its encoder jumps by 0.5 rad",
        FaultKind.RESET: "the drive restarts",
        FaultKind.POWER_DIP: "the power of all dips",
    },
)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_fault_in_every_phase(site: Site) -> None:
    TABLE.require_documented(site)


QUICK = [
    (FaultKind.OVERLOAD, "run", "overload"),
    pytest.param(FaultKind.LOSE, "run", "", marks=pytest.mark.slow),
    pytest.param(FaultKind.BUS_OFF, "run", "stale-state", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("kind", "phase", "reason"), QUICK)
def test_some_faults_in_some_phases(site: Site, kind: FaultKind, phase: str, reason: str) -> None:
    TABLE.require_end(site, kind, phase, reason)
