"""The device's own record of what the arm did: proof of a stop when nobody else was there to see it."""

import os
from pathlib import Path

from tauscope_sim.device.activity import Activity
from tauscope_sim.device.device import SimulatedDevice

_INTERVAL_NS = 4_000_000
_INTERVAL_AT_REST_NS = 500_000_000
FIXED_COLUMNS = ("time_ns", "activity", "faults")


class TraceWriter:
    """Appends lines to a CSV file: time, activity, faults, true position and velocity of each joint.

    Each line is written at once and by itself, so that the file is complete up to the last line when the process dies.
    """

    def __init__(self, path: Path, device: SimulatedDevice) -> None:
        self._device = device
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o644)
        count = device.capabilities.joint_count
        names = [*FIXED_COLUMNS, *(f"{kind}{joint + 1}" for kind in ("q", "qd") for joint in range(count))]
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
