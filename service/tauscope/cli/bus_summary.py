"""``tauscope bus scan`` and ``tauscope run --dry-run``: devices and frames on a terminal."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope.cli.terminal import output, plain, shown_progress, table
from tauscope.errors import AcquisitionError
from tauscope.report.table import Table
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import (
    FoundDevice,
    FrameRequest,
    find_bus,
    find_driver,
    select_bus,
    to_drive_joints,
    translate_driver_errors,
)
from tauscope.runtime.guard import guard_limits
from tauscope.runtime.options import RunOptions
from tauscope.trajectory import read_trajectory

SHOWN_CYCLES = 3
"""Cycles of a run whose frames are shown."""

_RATE_HZ = 200.0


def show_devices(backend: str, port: str, bit_rates: Sequence[int] | None) -> None:
    """Scan a bus and show who answers.

    Parameters
    ----------
    bit_rates : sequence of int or None
        to try [bit/s]; the usual ones where None

    Raises
    ------
    AcquisitionError
        nobody answers, or the port is missing, not permitted or taken
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

    Raises
    ------
    AcquisitionError
        a drive block or a limit is not possible
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
