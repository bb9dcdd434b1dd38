"""Reads the trace that the simulated device writes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope_sim.device.drives import Activity
from tauscope_sim.device.server import FIXED_COLUMNS

Array = NDArray[np.float64]


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
    if tuple(names[:3]) != FIXED_COLUMNS:
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
