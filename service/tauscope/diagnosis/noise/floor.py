"""The noise of every joint's rows, from the data and not from the fit.

Where motion repeats, what differs between repetitions is noise whatever the model lacks (pure error). Elsewhere all
that a model leaves stands in for it, as white noise: its colour may be a left-out effect's.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import full_torque, residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.period_pairs import period_pairs, rounding_repeats
from tauscope.diagnosis.observations.whitening import JointNoise, fitted_noise
from tauscope.identification.autocorrelation import Autoregression
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array

FEWEST_ROWS = 150  # rows of pure error that a joint's noise model needs


def with_pure_error(observations: Observations, model: ExtendedModel) -> Observations | None:
    """The observations with the noise that repetitions show; None where they are too few at some joint."""
    differences = [] if rounding_repeats(observations) else list(repeated_differences(observations, model))
    pure = [
        [(rows[j], used[j], factor) for rows, used, factor in differences]
        for j in range(observations.robot.joint_count)
    ]
    if any(sum(int(used.sum()) for _, used, _ in parts) < FEWEST_ROWS for parts in pure):
        return None
    share = band_share(observations)
    return observations.with_noise([fitted_noise(parts, share) for parts in pure])


def repeated_differences(
    observations: Observations, model: ExtendedModel
) -> Iterator[tuple[Array, NDArray[np.bool_], float]]:
    """What the residual of a period differs by from that of the period before: noise, whatever the model lacks.

    Rows in the common band, (n, M), which of them rest on measured torque, (n, M), and the factor that turns their
    power into the noise's.
    """
    for piece in observations:
        motion = piece.prepared.motion
        pairs = list(period_pairs(observations, piece))
        if not pairs:
            continue
        residual = motion.torque[0].T - full_torque(model, piece)
        measured = np.ascontiguousarray(motion.measured[0].T)
        for pair in pairs:
            rows = motion.band.reduce(np.ascontiguousarray(pair.later(residual) - residual[:, pair.earlier]))
            used = motion.band.reduce_mask(measured[:, pair.earlier] & measured[:, pair.near])
            yield rows, used, pair.factor


def white_noise(observations: Observations, model: ExtendedModel, share: float = 1.0) -> list[JointNoise]:
    """White noise as large as all that a model leaves. `share`: independent rows among all."""
    found = []
    for pieces in residual_rows(model, observations):
        power = float(np.mean(np.concatenate([rows[0] for rows in pieces]) ** 2)) + np.finfo(float).tiny
        found.append(JointNoise(Autoregression(np.empty(0), power, power), share))
    return found


def band_share(observations: Observations) -> float:
    """Cut-off of the common band relative to the highest frequency of the rows; 1 where nothing is filtered."""
    shares = []
    for piece in observations:
        band = piece.prepared.motion.band
        if isinstance(band, Decimator):
            response = np.abs(np.fft.rfft(band.kernel, 1 << 14))
            cutoff = float(np.argmax(response < 0.5)) / (1 << 14) * piece.prepared.motion.rate_hz
            shares.append(min(2.0 * cutoff / band.rate_hz, 1.0))
    return min(shares, default=1.0)
