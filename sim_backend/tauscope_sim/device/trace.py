"""The device's own record of what the arm did: proof of a stop when nobody else was there to see it."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope_sim.device.activity import Activity
from tauscope_sim.device.device import SimulatedDevice

Array = NDArray[np.float64]

_INTERVAL_NS = 4_000_000
_INTERVAL_AT_REST_NS = 500_000_000
_FIXED_COLUMNS = ("time_ns", "activity", "faults")


class TraceWriter:
    """Appends lines to a CSV file: time, activity, faults, true position and velocity of each joint.

    Each line is written at once and by itself, so that the file is complete up to the last line when the process dies.
    """

    def __init__(self, path: Path, device: SimulatedDevice) -> None:
        self._device = device
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o644)
        count = device.capabilities.joint_count
        names = [*_FIXED_COLUMNS, *(f"{kind}{joint + 1}" for kind in ("q", "qd") for joint in range(count))]
        self._write(",".join(names))
        self._last: tuple[Activity, tuple[str, ...]] | None = None
        self._due_ns = 0

    def note(self) -> None:
        """Write a line where one is due: something changed, or some time has passed."""
        device = self._device
        status = (device.activity, device.fault_codes)
        if status == self._last and device.time_ns < self._due_ns:
            return
        self._last = status
        at_rest = device.activity is Activity.BRAKED
        self._due_ns = device.time_ns + (_INTERVAL_AT_REST_NS if at_rest else _INTERVAL_NS)
        position, velocity = device.true_motion
        numbers = [f"{value:.9g}" for value in (*position.tolist(), *velocity.tolist())]
        self._write(",".join([str(device.time_ns), device.activity.value, "+".join(device.fault_codes), *numbers]))

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _write(self, line: str) -> None:
        """Hand one line to the operating system."""
        os.write(self._file, (line + "\n").encode())


@dataclass(frozen=True, eq=False)
class DeviceTrace:
    """What a trace file says, a row a line.

    time_ns : (N,) int64
        device time: the machine's monotonic clock [ns]
    position : (N, n) float64
        true position of the links [rad or m]
    velocity : (N, n) float64
        true velocity of the links [rad/s or m/s]
    """

    time_ns: NDArray[np.int64]
    activity: tuple[Activity, ...]
    faults: tuple[tuple[str, ...], ...]
    position: Array
    velocity: Array


def read_trace(path: Path) -> DeviceTrace:
    """Read a trace, also while it is being written: a last line that is not complete is left out.

    Raises
    ------
    RecordingError
        where the file is not a trace
    """
    text = path.read_text(encoding="utf-8")
    header, *lines = text[: text.rfind("\n") + 1].splitlines() or [""]
    names = header.split(",")
    if tuple(names[:3]) != _FIXED_COLUMNS:
        raise RecordingError(f"{path}: not a trace of the simulated device; name the file that the device wrote")
    rows = [line.split(",") for line in lines]
    numbers = np.array([[float(cell) for cell in row[3:]] for row in rows]).reshape(len(rows), len(names) - 3)
    count = (len(names) - 3) // 2
    return DeviceTrace(
        time_ns=np.array([int(row[0]) for row in rows], dtype=np.int64),
        activity=tuple(Activity(row[1]) for row in rows),
        faults=tuple(tuple(filter(None, row[2].split("+"))) for row in rows),
        position=numbers[:, :count],
        velocity=numbers[:, count:],
    )
