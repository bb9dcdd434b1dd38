"""Every fault of the kit in every phase of a run: how it ends, what is said, what is kept. The table in docs/ is this.

Run with ``TAUSCOPE_WRITE_DOCS=1`` to renew the table. The servos' time passes in step with the host's cycles, so that
the table is the same on every machine.
"""

from collections.abc import Iterator

import pytest

from hardware_emulated.campaign_arms import three_joints, write_robot
from hardware_emulated.fault_runs import Site, fault_site
from hardware_emulated.fault_table import FaultTable
from hardware_emulated.servo_kinds import servos_of
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.robot import Robot
from tauscope.runtime.drivers import find_driver, to_drive_joints
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_sim.dynamixel_bus import DynamixelOrder
from tauscope_sim.emulation import FaultKind


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("faults")
    robot_file = write_robot(three_joints(), folder / "arm.json", str(folder / "port"))

    def order(robot: Robot, start: tuple[float, ...]) -> DynamixelOrder:
        port, control = str(folder / "port"), str(folder / "control")
        return DynamixelOrder(
            servos=servos_of(robot), start=start, port=port, control=control, robot=str(robot_file), stepped=True
        )

    with fault_site(robot_file, order) as one:
        yield one


def arm_of(site: Site) -> DynamixelArm:
    return DynamixelArm(
        to_drive_joints(find_driver("dynamixel"), site.robot), slack_s=0.1, clock=SteppedClock(site.emulator)
    )


TABLE = FaultTable(
    bus="dynamixel",
    title="Faults of a Dynamixel bus, phase by phase",
    arm_of=arm_of,
    devices="servos",
    device="servo",
    half_radian=80_000,
    names={
        FaultKind.LOSE: "two answers are lost",
        FaultKind.CORRUPT: "two answers arrive damaged",
        FaultKind.LATE: "two answers are 60 ms late",
        FaultKind.DUPLICATE: "five answers arrive twice",
        FaultKind.SILENT: "the servo falls silent",
        FaultKind.OVER_TEMPERATURE: "the servo is too hot",
        FaultKind.OVERLOAD: "the servo is overloaded",
        FaultKind.ENCODER_JUMP: "its encoder jumps by 0.5 rad",
        FaultKind.RESET: "the servo restarts",
        FaultKind.POWER_DIP: "the power of all dips",
    },
    absent=frozenset({FaultKind.BUS_OFF}),
)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_fault_in_every_phase(site: Site) -> None:
    TABLE.require_documented(site)


QUICK = [
    (FaultKind.OVERLOAD, "run", "overload"),
    pytest.param(FaultKind.SILENT, "stop", "silent", marks=pytest.mark.slow),
    pytest.param(FaultKind.LOSE, "run", "", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("kind", "phase", "reason"), QUICK)
def test_some_faults_in_some_phases(site: Site, kind: FaultKind, phase: str, reason: str) -> None:
    TABLE.require_end(site, kind, phase, reason)
