"""Shooting segments: short pieces of recordings, each simulated from the real state at its begin."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tauscope.closed_loop import plant
from tauscope.closed_loop.drive import LoopDrive, record_motion
from tauscope.errors import RecordingError
from tauscope.recording import Recording
from tauscope.recording.recording import Array
from tauscope.robot import Actuator

SEGMENT_S = 0.3
"""Length of a segment [s]: several times the response of a servo, and too short for stick-slip to lose its phase."""

STRIDE = 2
"""Steps of a rollout in one of a segment: half the effort, and still several in the response of a fast servo."""

STEP_S = STRIDE * plant.STEP_S

MOST_SEGMENTS = 120
"""Segments that are simulated side by side, evenly chosen."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Motion and commands of S segments of K steps.

    position : (K, n, S) float64
        q of the real arm; NaN where it was missed [rad or m]
    begin : (n, S) float64
        q̇ at the first step [rad/s or m/s]
    command : (K, n, S) float64
        of the loops
    voltage, gain, temperature : (K, n, S) float64 or None
        of the loops, where recorded [V, register or Nm/rad, °C]
    """

    position: Array
    begin: Array
    command: Array
    voltage: Array | None
    gain: Array | None
    temperature: Array | None

    @property
    def count(self) -> int:
        """S."""
        return self.position.shape[2]

    @cached_property
    def mean_temperature(self) -> float | None:
        """Mean over all joints [°C]; None where none was recorded."""
        if self.temperature is None or not np.isfinite(self.temperature).any():
            return None
        return float(np.nanmean(self.temperature))

    @cached_property
    def warmth(self) -> Array | None:
        """Temperature above its mean, (K, n, S) [K]; None where none was recorded."""
        if self.temperature is None or self.mean_temperature is None:
            return None
        return np.nan_to_num(self.temperature - self.mean_temperature)

    @staticmethod
    def of(recordings: Sequence[Recording], loops: Sequence[Actuator]) -> "Segments":
        """Segments of recordings with commands.

        Raises
        ------
        RecordingError
            no recording is long enough
        """
        steps = round(SEGMENT_S / plant.STEP_S)
        groups: dict[str, list[Array | None]] = {name: [] for name in ("q", "qd", "command", "volt", "gain", "temp")}
        for recording in recordings:
            motion = record_motion(recording)
            drive = LoopDrive(loops, recording, motion.time, is_damped=True)
            known = np.stack([np.isfinite(column) for column in motion.measured.T], axis=1).all(axis=1)
            whole = np.interp(motion.time, motion.rows, known.astype(float)) == 1.0
            for start in range(0, len(motion.time) - steps + 1, steps):
                piece = slice(start, start + steps, STRIDE)
                if not whole[piece].all():
                    continue
                groups["q"].append(motion.position[piece])
                groups["qd"].append(motion.velocity[start])
                groups["command"].append(drive.command[piece])
                for name, values in (("volt", drive.voltage), ("gain", drive.gain), ("temp", drive.temperature)):
                    groups[name].append(None if values is None else values[piece])
        total = len(groups["q"])
        chosen = np.unique(np.linspace(0, total - 1, min(total, MOST_SEGMENTS)).round().astype(int)) if total else []

        def stack(name: str) -> Array | None:
            values = [groups[name][place] for place in chosen]
            parts = [each for each in values if each is not None]
            return np.stack(parts, axis=-1) if parts and len(parts) == len(values) else None

        position, begin, command = stack("q"), stack("qd"), stack("command")
        if position is None or begin is None or command is None:
            hint = f"record {SEGMENT_S:g} s or more without gaps"
            raise RecordingError(f"{recordings[0].name}: no piece of {SEGMENT_S:g} s to refine by; {hint}")
        return Segments(position, begin, command, stack("volt"), stack("gain"), stack("temp"))
