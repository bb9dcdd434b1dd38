"""``tauscope doctor``, ``tauscope release`` and ``tauscope bus``: what drives say, and what is sent to them."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console

from tauscope.cli.terminal import output, plain, shown_progress, table
from tauscope.errors import AcquisitionError, MissingExtraError
from tauscope.extras import require_extra
from tauscope.number_text import counted
from tauscope.report.tables import Table
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import (
    Finding,
    FoundDevice,
    FrameRequest,
    Severity,
    bus_drivers,
    find_bus,
    find_driver,
    select_bus,
    to_drive_joints,
    translate_driver_errors,
)
from tauscope.runtime.guard import guard_limits
from tauscope.runtime.options import RunOptions
from tauscope.runtime.release import release
from tauscope.trajectory import read_trajectory

_MARKS = {Severity.GOOD: "ok", Severity.WARNING: "warning", Severity.FAILURE: "failure"}


def show_findings(robot: Path | None, backend: str | None) -> None:
    """Look, and show what was found.

    Raises AcquisitionError: something keeps the arm from running, or the robot file speaks of no bus.
    """
    with shown_progress() as told:
        told("look at the adapters" if robot is None else "ask the drives")
        findings = _adapters(backend) if robot is None else _drives(robot, backend)
    console = output()
    for finding in findings:
        show_finding(console, finding)
    require_sound(findings)


def require_sound(findings: Sequence[Finding]) -> None:
    """Refuse to go on where a finding is a failure. Raises AcquisitionError, which names the first."""
    failures = [finding for finding in findings if finding.severity is Severity.FAILURE]
    if failures:
        first = failures[0]
        raise AcquisitionError(
            f"{counted(len(failures), 'finding')} of {len(findings)} to mend first: {first.subject}: {first.detail}; "
            f"{first.remedy}"
        )


def check_drives(path: Path) -> list[Finding]:
    """Everything doubtful in a robot file's ``drive`` blocks and the files that they name, without a port.

    Nothing where no bus is meant, or where the drivers are not installed. Raises AcquisitionError where a joint has no
    ``drive`` block, and another one has.
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


def release_arm(path: Path, backend: str | None, *, is_supported: bool) -> None:
    """Let go of an arm.

    Raises AcquisitionError where nobody states that it is supported, or a drive is not reached or under power still.
    """
    robot = read_robot(path)
    bus = select_bus(robot) if backend is None else find_bus(backend)
    if not is_supported and not _ask(robot.name):
        raise AcquisitionError(f"{robot.name} holds on; support it, then state --supported")
    release(bus.name, robot, {})
    output().print(plain(f"{robot.name}: no drive is under power"), soft_wrap=True)


def _ask(name: str) -> bool:
    """Whether somebody at a terminal says that the arm is supported."""
    return sys.stdin.isatty() and typer.confirm(f"{name} will be without torque. Is it supported?")


SHOWN_CYCLES = 3
"""Cycles of a run whose frames are shown."""

_RATE_HZ = 200.0


def show_devices(backend: str, port: str, bit_rates: Sequence[int] | None) -> None:
    """Scan a bus and show who answers.

    Raises AcquisitionError where nobody answers, or the port is missing, not permitted or taken.

    `bit_rates`: to try [bit/s]; the usual ones where None.
    """
    found: list[FoundDevice] = []
    bus = find_bus(backend)
    with shown_progress() as told, translate_driver_errors():
        told(f"scan {port}")
        for device in bus.scan(port, bit_rates or None):
            found.append(device)
            told(f"scan {port}: {len(found)} found")
    if not found:
        others = f" ({bus.neighbours})" if bus.neighbours else ""
        raise AcquisitionError(f"{port}: nobody answers{others}; check power, cable, termination and bit rate")
    rows = [(str(one.address), one.model, one.firmware, str(one.bit_rate)) for one in found]
    output().print(table("Devices", Table(("address", "model", "firmware", "bit/s"), rows, words=2)))


def show_frames(robot_file: Path, backend: str, trajectory: Path | None, options: RunOptions) -> None:
    """Show the frames that a run would send: connecting, enabling, its first cycles, stopping.

    Raises AcquisitionError where a drive block or a limit is not possible.
    """
    robot = read_robot(robot_file)
    targets = _targets(robot, trajectory, options)
    rate_hz = options.rate_hz or _RATE_HZ
    speed = np.abs(np.diff(targets, axis=0)).max(axis=0) * rate_hz
    limits = guard_limits(robot, targets.min(axis=0), targets.max(axis=0), speed).drive_limits
    request = FrameRequest(options.mode, limits, options.watchdog_s, targets[:SHOWN_CYCLES], 1.0 / rate_hz)
    console = output()
    bus = select_bus(robot) if find_driver(backend).is_simulated else find_bus(backend)
    with translate_driver_errors():
        for frame in bus.plan_frames(to_drive_joints(bus, robot), request):
            console.print(plain(f"{frame.phase} | {frame.wire} | {frame.meaning}"), soft_wrap=True)


def _targets(robot: Robot, trajectory: Path | None, options: RunOptions) -> NDArray[np.float64]:
    """Targets of all cycles."""
    if trajectory is None:
        ends = [joint.limits.position or (0.0, 0.0) for joint in robot.joints]
        place = np.array([min(max(0.0, low), high) for low, high in ends])
        return np.tile(place, (SHOWN_CYCLES, 1))
    return read_trajectory(trajectory, robot).samples(options.rate_hz or _RATE_HZ).position
