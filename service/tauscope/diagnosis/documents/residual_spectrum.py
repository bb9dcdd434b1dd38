"""At which frequencies a model leaves torque, beside the noise's own spectrum."""

import numpy as np
from pydantic import Field
from scipy import signal

from tauscope.diagnosis.documents.torque_overlay import judging_observations, rounded
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.recording.recording import Array
from tauscope.strict_model import ResultModel

LONGEST_SEGMENT = 256  # rows of one segment of Welch's method
FEWEST = 32  # rows of a repetition that is long enough to have a spectrum
AVERAGED = 6  # segments' worth of rows that a density is the mean of, where there are so many: fewer are mostly chance


class ResidualSpectrum(ResultModel):
    """Power spectral density of one joint's residual, one-sided, up to the end of the common band."""

    joint: str = Field(description="name of the joint")
    held_out: bool = Field(description="whether it is that of recordings that neither model was made from")
    frequency: list[float] = Field(description="[Hz]")
    before: list[float] = Field(description="what the model without the findings leaves [(Nm)²/Hz or N²/Hz]")
    after: list[float] = Field(description="what the model with them leaves [(Nm)²/Hz or N²/Hz]")
    noise: list[float] = Field(description="of the noise [(Nm)²/Hz or N²/Hz]")


def residual_spectra(diagnosis: Diagnosis) -> list[ResidualSpectrum]:
    """Spectra of all joints; none where no stretch of motion is long enough."""
    observations, held_out = judging_observations(diagnosis)
    longest = max((piece.rows for piece in observations), default=0)
    if longest < FEWEST:
        return []
    rows = sum(piece.rows * piece.repetitions for piece in observations)
    segment = min(LONGEST_SEGMENT, longest, max(FEWEST, rows // AVERAGED))
    rate = next(piece.prepared.motion.band.rate_hz for piece in observations)
    frequency = rate / segment * np.arange(segment // 2 + 1, dtype=np.float64)
    shown = (frequency > 0.0) & (frequency <= diagnosis.cutoff_hz)
    models = (diagnosis.selection.nominal.model, diagnosis.selection.fit.model)
    densities = [_densities(model, observations, segment) for model in models]
    return [
        ResidualSpectrum(
            joint=described.name,
            held_out=held_out,
            frequency=rounded(frequency[shown]),
            before=rounded(densities[0][joint][shown]),
            after=rounded(densities[1][joint][shown]),
            noise=rounded(noise_density(observations.noise[joint], frequency[shown], rate)),
        )
        for joint, described in enumerate(diagnosis.robot.joints)
    ]


def noise_density(noise: JointNoise, frequency: Array, rate_hz: float) -> Array:
    """Noise 2 σ² / (f_s |1 - Σ a_k e^{-iωk}|²) at `frequency`, (F,) [Hz], one-sided, (F,) [(Nm)²/Hz or N²/Hz]."""
    polynomial = np.append(1.0, -noise.model.coefficients)
    _, response = signal.freqz(polynomial, worN=2.0 * np.pi * frequency / rate_hz)
    return 2.0 * noise.model.innovation_variance / (rate_hz * np.abs(response) ** 2)


def _densities(model: ExtendedModel, observations: Observations, segment: int) -> list[Array]:
    """Mean density of every joint's residual over all repetitions that are as long as a segment."""
    found = []
    for joint, pieces in enumerate(residual_rows(model, observations)):
        total, weight = np.zeros(segment // 2 + 1), 0.0
        for piece, rows in zip(observations, pieces, strict=True):
            if piece.rows < segment:
                continue
            known = np.where(piece.used[joint].ravel(), rows[0], 0.0).reshape(piece.repetitions, -1)
            rate = piece.prepared.motion.band.rate_hz
            _, density = signal.welch(known, rate, nperseg=segment, detrend=False, axis=-1)
            total += piece.rows * density.sum(axis=0)
            weight += piece.rows * piece.repetitions
        found.append(total / weight)
    return found
