"""``tauscope doctor``, ``tauscope release`` and ``tauscope bus``: what drives say, and what is sent to them."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from typer import Argument, Option

from tauscope.cli.arguments import RobotFile, name_input
from tauscope.cli.terminal import output, say, show_progress, table
from tauscope.cli.verbs import make_group
from tauscope.errors import AcquisitionError, MissingExtraError
from tauscope.extras import require_extra
from tauscope.number_text import counted
from tauscope.report.tables import Table
from tauscope.robot import Robot, read_robot
from tauscope.runtime import drivers
from tauscope.runtime.guard import guard_limits
from tauscope.runtime.options import RunOptions
from tauscope.runtime.run import release as release_drives
from tauscope.trajectory import read_trajectory

if TYPE_CHECKING:
    BusName = str
else:
    BusName = Literal[tuple(drivers.bus_drivers())]
    """A name of a registered driver of a field bus: help lists the choices."""

BusOption = Annotated[BusName | None, Option(help="Field bus; by default the one of the robot file's drives.")]
DoctorRobotFile = Annotated[
    Path | None,
    name_input(
        "Robot file (YAML) whose drives are looked at; without one, the adapters of this machine.", "ROBOT", Argument
    ),
]
_MARKS = {drivers.Severity.GOOD: "ok", drivers.Severity.WARNING: "warning", drivers.Severity.FAILURE: "failure"}


def doctor(robot: DoctorRobotFile = None, *, backend: BusOption = None) -> None:
    """Look at adapters and drives, and say what keeps an arm from running well, each with its remedy.

    Moves nothing and writes nothing. Exit status 1 where something keeps the arm from running.
    """
    with show_progress() as told:
        told("look at the adapters" if robot is None else "ask the drives")
        findings = _adapters(backend) if robot is None else _drives(robot, backend)
    console = output()
    for finding in findings:
        show_finding(console, finding)
    require_sound(findings)


def release(
    robot: RobotFile,
    *,
    backend: BusOption = None,
    supported: Annotated[bool, Option("--supported", help="State that the arm is supported.")] = False,
) -> None:
    """Let go of an arm that holds: its drives give no torque any more.

    Support the arm first: joints without a brake fall. Settings that a run changed in servos' EEPROM are put back.
    """
    arm = read_robot(robot)
    bus = drivers.select_bus(arm) if backend is None else drivers.find_bus(backend)
    question = f"{arm.name} will be without torque. Is it supported?"
    if not supported and not (sys.stdin.isatty() and typer.confirm(question)):
        raise AcquisitionError(f"{arm.name} holds on; support it, then state --supported")
    release_drives(bus.name, arm, {})
    say(f"{arm.name}: no drive is under power")


def scan(
    backend: Annotated[BusName, Argument(metavar="BUS", help="Field bus.")],
    port: Annotated[
        str,
        Argument(
            metavar="PORT",
            help=", ".join(f"{bus.port_help} ({name})" for name, bus in drivers.bus_drivers().items()) + ".",
        ),
    ],
    *,
    bit_rate: Annotated[
        list[int] | None,
        Option(metavar="RATE", min=1, help="Bit rate to try; may be repeated. The usual ones by default."),
    ] = None,
) -> None:
    """Show every device that answers on a bus.

    Moves nothing and writes nothing. Exit status 1 where nobody answers.
    """
    found: list[drivers.FoundDevice] = []
    bus = drivers.find_bus(backend)
    with show_progress() as told, drivers.translate_driver_errors():
        told(f"scan {port}")
        for device in bus.scan(port, bit_rate or None):
            found.append(device)
            told(f"scan {port}: {len(found)} found")
    if not found:
        others = f" ({known})" if (known := drivers.describe_neighbours(bus)) else ""
        raise AcquisitionError(f"{port}: nobody answers{others}; check power, cable, termination and bit rate")
    rows = [(str(one.address), one.model, one.firmware, str(one.bit_rate)) for one in found]
    output().print(table("Devices", Table(("address", "model", "firmware", "bit/s"), rows, words=2)))


def require_sound(findings: Sequence[drivers.Finding]) -> None:
    """Refuse to go on where a finding is a failure. Raises AcquisitionError, which names the first."""
    failures = [finding for finding in findings if finding.severity is drivers.Severity.FAILURE]
    if failures:
        first = failures[0]
        raise AcquisitionError(
            f"{counted(len(failures), 'finding')} of {len(findings)} to mend first: {first.subject}: {first.detail}; "
            f"{first.remedy}"
        )


def check_drives(path: Path) -> list[drivers.Finding]:
    """Everything doubtful in ``drive`` blocks, without a port. Raises AcquisitionError where one has no block."""
    robot = read_robot(path)
    meant = [
        bus for bus in drivers.bus_drivers().values() if any(bus.is_meant(joint.drive or {}) for joint in robot.joints)
    ]
    if len(meant) != 1:
        return []
    (bus,) = meant
    try:
        with require_extra("checking the drives"):
            return bus.check_blocks(drivers.to_drive_joints(bus, robot))
    except MissingExtraError as error:
        return [drivers.Finding(drivers.Severity.WARNING, bus.name, "its files were not read", str(error))]


def _adapters(backend: str | None) -> list[drivers.Finding]:
    buses = drivers.bus_drivers().values() if backend is None else [drivers.find_bus(backend)]
    found: list[drivers.Finding] = []
    for bus in buses:
        adapters = bus.list_adapters()
        found += adapters or [drivers.Finding(drivers.Severity.WARNING, bus.name, "no adapter is there", "plug one in")]
    return list(dict.fromkeys(found))  # several buses may hang on one kind of adapter


def _drives(path: Path, backend: str | None) -> Sequence[drivers.Finding]:
    robot = read_robot(path)
    bus = drivers.select_bus(robot) if backend is None else drivers.find_bus(backend)
    with drivers.translate_driver_errors():
        return bus.examine(drivers.to_drive_joints(bus, robot))


def show_finding(console: Console, finding: drivers.Finding) -> None:
    remedy = f"; {finding.remedy}" if finding.remedy else ""
    say(f"{_MARKS[finding.severity]}: {finding.subject}: {finding.detail}{remedy}", console)


SHOWN_CYCLES = 3  # cycles of a run whose frames are shown
_RATE_HZ = 200.0


def show_frames(robot_file: Path, backend: str, trajectory: Path | None, options: RunOptions) -> None:
    """Show the frames of a run. Raises AcquisitionError where a drive block or a limit is not possible."""
    robot = read_robot(robot_file)
    targets = _targets(robot, trajectory, options)
    rate_hz = options.rate_hz or _RATE_HZ
    speed = np.abs(np.diff(targets, axis=0)).max(axis=0) * rate_hz
    limits = guard_limits(robot, targets.min(axis=0), targets.max(axis=0), speed).drive_limits
    request = drivers.FrameRequest(options.mode, limits, options.watchdog_s, targets[:SHOWN_CYCLES], 1.0 / rate_hz)
    console = output()
    bus = drivers.select_bus(robot) if drivers.find_driver(backend).is_simulated else drivers.find_bus(backend)
    with drivers.translate_driver_errors():
        for frame in bus.plan_frames(drivers.to_drive_joints(bus, robot), request):
            say(f"{frame.phase} | {frame.wire} | {frame.meaning}", console)


def _targets(robot: Robot, trajectory: Path | None, options: RunOptions) -> NDArray[np.float64]:
    if trajectory is None:
        ends = [joint.limits.position or (0.0, 0.0) for joint in robot.joints]
        place = np.array([min(max(0.0, low), high) for low, high in ends])
        return np.tile(place, (SHOWN_CYCLES, 1))
    return read_trajectory(trajectory, robot).samples(options.rate_hz or _RATE_HZ).position


bus = make_group(scan=scan)
