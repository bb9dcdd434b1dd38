"""What the columns themselves do not know: friction's step where a joint's velocity is smaller than its own error.

Under stiff friction a joint sticks at every reversal: its torque runs from one level to the other while the velocity
creeps within ±1/K_v. No position sensor shows that. With a velocity known to ±δ the step is known to

    u = |F(q̇ + δ) - F(q̇ - δ)| / 2,        F(q̇) = τ_s A(K_v q̇) + τ_sc A(δ_s q̇),

which is zero but near reversals. Rows that such an instant enters count less: taken at full weight, thirty reversals
of rounded corners look like a delay, a rotor, or bristles.

An encoder of step s makes white noise of a joint that crosses many steps within the motion's time constant. Slower than
v = s f, with f the band of the motion, single steps are followed, and the velocity is uncertain by v itself.
"""

from collections.abc import Sequence

import numpy as np

from service.diagnosis.fit import Fitter
from service.diagnosis.model import ExtendedModel
from service.diagnosis.observations import Observations, Piece
from service.dynamics import smooth_sign
from service.recording.conditioning.common_band import Decimator
from service.recording.conditioning.filters import smooth
from service.recording.recording import Array

FAR_OFF = 6.0
"""Power that the nominal model leaves, in noise variances, beyond which its friction is no guide to anything."""

HALF_BAND = 0.5
"""What the motion's velocity is without the upper half of its band stands for how far the band itself may be off."""


def row_weights(observations: Observations, model: ExtendedModel) -> tuple[Array, ...]:
    """Weight of every whitened row that counts, (R_j,) a joint: 1 where the columns are certain.

    Parameters
    ----------
    observations : Observations
        the data, noise known
    model : ExtendedModel
        the nominal model
    """
    fit = Fitter(observations).fit(model)  # an identification leaves alone what it cannot tell, however large it is
    if fit.inflation() > FAR_OFF:
        return tuple(np.ones(int(observations.kept(joint).sum())) for joint in range(len(observations.noise)))
    return weights_of_motion(observations, fit.model)


def weights_of_motion(observations: Observations, model: ExtendedModel) -> tuple[Array, ...]:
    """The same by a model that is right about friction, whatever torque was measured, (R_j,) a joint.

    Parameters
    ----------
    observations : Observations
        the data, noise known
    model : ExtendedModel
        the model
    """
    weights = []
    for joint, noise in enumerate(observations.noise):
        power = noise.model.variance
        parts = [
            1.0 / np.sqrt(1.0 + _uncertain_power(piece, model, joint)[noise.order :] / power) for piece in observations
        ]
        weights.append(np.concatenate(parts)[observations.kept(joint)])
    return tuple(weights)


def _uncertain_power(piece: Piece, model: ExtendedModel, joint: int) -> Array:
    """Variance of a row's friction, (M,) [Nm² or N²]."""
    motion = piece.prepared.motion
    velocity = motion.velocity[:, joint]
    rate, state_hz = motion.rate_hz, piece.state_hz
    crawl = piece.position_noise.step[joint] * state_hz
    noise = np.hypot(piece.velocity_std[joint], np.where(np.abs(velocity) < crawl, crawl, 0.0))
    narrow = smooth(velocity[:, None], rate, HALF_BAND * state_hz)[:, 0]
    at_random = _step_error(model, joint, velocity, noise)
    rounded = _step_error(model, joint, velocity, np.abs(velocity - narrow))
    band = motion.band
    if not isinstance(band, Decimator):
        return at_random**2 + rounded**2
    squared = Decimator(band.kernel**2, band.factor, band.rate_hz)
    whole = Decimator(np.abs(band.kernel), band.factor, band.rate_hz)
    together = max(rate / (2.0 * state_hz), 1.0)  # samples that share one error of the velocity
    return together * squared.reduce(at_random**2) + whole.reduce(rounded) ** 2


def _step_error(model: ExtendedModel, joint: int, velocity: Array, error: Array) -> Array:
    """U for a velocity known to ± error, (N,)."""
    ahead, behind = (_steps(model, joint, velocity + sign * error) for sign in (1.0, -1.0))
    return 0.5 * np.abs(ahead - behind)


def _steps(model: ExtendedModel, joint: int, velocity: Array) -> Array:
    """Coulomb and Stribeck part of a joint's friction, (N,)."""
    total = np.zeros_like(velocity)
    terms = model.structure.terms[joint]
    steps: Sequence[tuple[str, float | None]] = (("stiction", terms.k_v), ("stribeck", terms.delta))
    for name, steepness in steps:
        column = model.structure.coefficient(joint, name)
        if column is not None and steepness is not None:
            total += model.parameters[column] * smooth_sign(velocity, steepness)
    return total
