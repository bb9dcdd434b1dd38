"""The noise of every joint's rows, that no model predicts, and how it is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import signal

from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import full_torque
from tauscope.diagnosis.noise.floor import FEWEST_ROWS, repeated_differences
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.period_pairs import rounding_repeats
from tauscope.headroom.motion_rows import MotionRows
from tauscope.headroom.repeated_motion import noise_between
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array

FloorKind = Literal["repetitions", "high_frequency", "none"]

STOP_BAND = 1.5
"""Frequencies from which the band's filter passes nothing, relative to its cut-off."""

OPEN = 0.9
"""…and up to which a recording's own anti-aliasing passes all, relative to its Nyquist frequency."""

FEWEST_FREQUENCIES = 16
"""Frequencies between the two that a density is told by."""

SEGMENT_S = 2.0
"""Length of a segment of Welch's method [s]."""


@dataclass(frozen=True)
class NoiseFloor:
    """Rms of the noise in the common band [Nm or N]; None where nothing tells it.

    Repetitions differ by noise alone. Noise above the band says what is within it as far as it is white.
    """

    rms: float | None
    kind: FloorKind


def noise_floors(diagnosis: Diagnosis, motions: Sequence[MotionRows]) -> list[NoiseFloor]:
    """The floor of every joint: by repeated periods, by recordings of the same motion, or by noise above the band."""
    observations = diagnosis.fitter.observations
    model = diagnosis.selection.fit.model
    known: list[tuple[FloorKind, Array]] = [
        ("repetitions", noise_between_periods(observations, model)),
        ("repetitions", noise_between(motions)),
        ("high_frequency", noise_above_band(observations, model, diagnosis.cutoff_hz)),
    ]
    return [_first_known([(kind, float(rms[joint])) for kind, rms in known]) for joint in range(len(known[0][1]))]


def _first_known(known: Sequence[tuple[FloorKind, float]]) -> NoiseFloor:
    return next((NoiseFloor(rms, kind) for kind, rms in known if np.isfinite(rms)), NoiseFloor(None, "none"))


def noise_between_periods(observations: Observations, model: ExtendedModel) -> Array:
    """Rms of what periods of a recording differ by, (n,) [Nm or N]; NaN where too few repeat."""
    joints = observations.robot.joint_count
    energy, count = np.zeros(joints), np.zeros(joints)
    if not rounding_repeats(observations):
        for rows, used, factor in repeated_differences(observations, model):
            energy += factor * np.sum(np.where(used, rows, 0.0) ** 2, axis=1)
            count += used.sum(axis=1)
    return np.where(count >= FEWEST_ROWS, np.sqrt(energy / np.maximum(count, 1.0)), np.nan)


def noise_above_band(observations: Observations, model: ExtendedModel, cutoff_hz: float) -> Array:
    """Rms in the band of white noise of the density above it, (n,) [Nm or N]; NaN where the band is open.

    `cutoff_hz`: of the band [Hz].
    """
    joints = observations.robot.joint_count
    power, weight = np.zeros(joints), 0.0
    for piece in observations:
        motion = piece.prepared.motion
        band = motion.band
        if not isinstance(band, Decimator):
            continue
        length = min(round(SEGMENT_S * motion.rate_hz), len(motion.time))
        left = np.where(motion.measured[0].T, motion.torque[0].T - full_torque(model, piece), 0.0)
        frequency, density = signal.welch(left, motion.rate_hz, nperseg=length, axis=-1)
        above = (frequency > STOP_BAND * cutoff_hz) & (frequency < OPEN * motion.rate_hz / 2.0)
        if above.sum() < FEWEST_FREQUENCIES:
            continue
        # σ² of a sample is density × f_s/2; the filter leaves Σ h² of it. The median: a resonance is no noise.
        white = np.median(density[:, above], axis=1) * motion.rate_hz / 2.0 * float(band.kernel @ band.kernel)
        power += white * len(motion.time)
        weight += len(motion.time)
    return np.sqrt(power / weight) if weight else np.full(joints, np.nan)
