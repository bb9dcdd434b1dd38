"""``tauscope doctor``: findings on a terminal, one a line, each with its remedy."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from tauscope.cli.terminal import output, plain, shown_progress
from tauscope.errors import AcquisitionError, MissingExtraError
from tauscope.extras import require_extra
from tauscope.number_text import counted
from tauscope.robot import read_robot
from tauscope.runtime.drivers import (
    Finding,
    Severity,
    bus_drivers,
    find_bus,
    select_bus,
    to_drive_joints,
    translate_driver_errors,
)

_MARKS = {Severity.GOOD: "ok", Severity.WARNING: "warning", Severity.FAILURE: "failure"}


def show_findings(robot: Path | None, backend: str | None) -> None:
    """Look, and show what was found.

    Raises
    ------
    AcquisitionError
        something keeps the arm from running, or the robot file speaks of no bus
    """
    with shown_progress() as told:
        told("look at the adapters" if robot is None else "ask the drives")
        findings = _adapters(backend) if robot is None else _drives(robot, backend)
    console = output()
    for finding in findings:
        show_finding(console, finding)
    require_sound(findings)


def require_sound(findings: Sequence[Finding]) -> None:
    """Refuse to go on where a finding is a failure.

    Raises
    ------
    AcquisitionError
        names the first
    """
    failures = [finding for finding in findings if finding.severity is Severity.FAILURE]
    if failures:
        first = failures[0]
        raise AcquisitionError(
            f"{counted(len(failures), 'finding')} of {len(findings)} to mend first: {first.subject}: {first.detail}; "
            f"{first.remedy}"
        )


def check_drives(path: Path) -> list[Finding]:
    """Everything doubtful in a robot file's ``drive`` blocks and the files that they name, without a port.

    Nothing where no bus is meant, or where the drivers are not installed.

    Raises
    ------
    AcquisitionError
        a joint has no ``drive`` block, and another one has
    """
    robot = read_robot(path)
    meant = [bus for bus in bus_drivers().values() if any(bus.is_meant(joint.drive or {}) for joint in robot.joints)]
    if len(meant) != 1:
        return []
    (bus,) = meant
    try:
        with require_extra("checking the drives"):
            return bus.check_blocks(to_drive_joints(bus, robot))
    except MissingExtraError as error:
        return [Finding(Severity.WARNING, bus.name, "its files were not read", str(error))]


def _adapters(backend: str | None) -> list[Finding]:
    """Adapters of one bus, or of all."""
    buses = bus_drivers().values() if backend is None else [find_bus(backend)]
    found: list[Finding] = []
    for bus in buses:
        adapters = bus.list_adapters()
        found += adapters or [Finding(Severity.WARNING, bus.name, "no adapter is there", "plug one in")]
    return list(dict.fromkeys(found))  # several buses may hang on one kind of adapter


def _drives(path: Path, backend: str | None) -> Sequence[Finding]:
    robot = read_robot(path)
    bus = select_bus(robot) if backend is None else find_bus(backend)
    with translate_driver_errors():
        return bus.examine(to_drive_joints(bus, robot))


def show_finding(console: Console, finding: Finding) -> None:
    """Show one finding on a line."""
    remedy = f"; {finding.remedy}" if finding.remedy else ""
    line = f"{_MARKS[finding.severity]}: {finding.subject}: {finding.detail}{remedy}"
    console.print(plain(line), soft_wrap=True)
