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

# Length of a segment [s]: several times the response of a servo, and too short for stick-slip to lose its phase.
SEGMENT_S = 0.3
STRIDE = 2  # steps of a rollout in one of a segment: half the effort, and still several in the response of a fast servo
STEP_S = STRIDE * plant.STEP_S

MOST_SEGMENTS = 120  # segments that are simulated side by side, evenly chosen


@dataclass(frozen=True, eq=False)
class Segments:
    """Motion and commands of S segments of K steps."""

    position: Array  # (K, n, S), q of the real arm; NaN where it was missed [rad or m]
    begin: Array  # (n, S), q̇ at the first step [rad/s or m/s]
    command: Array  # (K, n, S), of the loops
    voltage: Array  # (K, n, S), of the loops [V]
    gain: Array  # (K, n, S) [register or Nm/rad]
    temperature: Array  # (K, n, S) [°C]; NaN where it was not recorded

    @property
    def count(self) -> int:
        """S."""
        return self.position.shape[2]

    @cached_property
    def mean_temperature(self) -> float | None:
        """Mean over all joints [°C]; None where none was recorded."""
        return float(np.nanmean(self.temperature)) if np.isfinite(self.temperature).any() else None

    @cached_property
    def warmth(self) -> Array | None:
        """Temperature above its mean, (K, n, S) [K]; None where none was recorded."""
        mean = self.mean_temperature
        return None if mean is None else np.nan_to_num(self.temperature - mean)

    @staticmethod
    def of(recordings: Sequence[Recording], loops: Sequence[Actuator]) -> "Segments":
        """Segments of recordings with commands. Raises RecordingError where no recording is long enough."""
        steps = round(SEGMENT_S / plant.STEP_S)
        pieces: list[tuple[Array, ...]] = []
        for recording in recordings:
            motion = record_motion(recording)
            drive = LoopDrive(loops, recording, motion.time, is_damped=True)
            # A recording without a channel has the stated value, so that recordings may differ.
            stated = [[loop.supply_voltage or 0.0, loop.kp, np.nan] for loop in loops]
            channels = [
                np.broadcast_to(values, motion.position.shape) if own is None else own
                for own, values in zip((drive.voltage, drive.gain, drive.temperature), np.array(stated).T, strict=True)
            ]
            known = np.isfinite(motion.measured).all(axis=1)
            whole = np.interp(motion.time, motion.rows, known.astype(float)) == 1.0
            for start in range(0, len(motion.time) - steps + 1, steps):
                piece = slice(start, start + steps, STRIDE)
                if whole[piece].all():
                    rows = (motion.position, drive.command, *channels)
                    pieces.append((motion.velocity[start], *(values[piece] for values in rows)))
        if not pieces:
            hint = f"record {SEGMENT_S:g} s or more without gaps"
            raise RecordingError(f"{recordings[0].name}: no piece of {SEGMENT_S:g} s to refine by; {hint}")
        chosen = np.unique(np.linspace(0, len(pieces) - 1, min(len(pieces), MOST_SEGMENTS)).round().astype(int))
        begin, position, *others = (
            np.stack(group, axis=-1) for group in zip(*(pieces[place] for place in chosen), strict=True)
        )
        return Segments(position, begin, *others)
