"""What the columns themselves do not know: friction's step where a joint's velocity is smaller than its own error.

Under stiff friction a joint sticks at every reversal: its torque runs from one level to the other while the velocity
creeps within ±1/K_v. No position sensor shows that. With a velocity known to ±δ the step is known to

    u = |F(q̇ + δ) - F(q̇ - δ)| / 2,        F(q̇) = τ_s A(K_v q̇) + τ_sc A(δ_s q̇),

which is zero but near reversals. Rows that such an instant enters count less: taken at full weight, thirty reversals
of rounded corners look like a delay, a rotor, or bristles.

Nor are those errors independent. How a joint comes to rest is much the same at each of its reversals, and a band that
is too narrow for it moves and rounds F(t) = F(q̇(t)) alike at all of them. With the change that half the band makes,

    e = F(q̇ in f/2) - F(q̇ in f),        c = dF/dt,        d = (e·c)/(c·c),

the band itself has rounded by a part of what half of it rounds by, e - d c, and has moved all reversals by a part of
its period 1/f. On 199 simulated arms that lack nothing, 939 joints, it was 0.45 ± 0.30 of e - d c (mean and scatter,
the estimates' own errors taken out) and 0.016/f ± 0.010/f, whatever d; where an encoder's steps are followed one by
one, in bands of 5 Hz, 0.64 ± 0.22 and -0.028/f ± 0.044/f. Half as much again is allowed for, with either sign: an arm's
friction is never that of a simulation. What a fit could explain by it is not held against the model.

An encoder of step s makes white noise of a joint that crosses many steps within the motion's time constant. Slower than
v = s f, with f the band of the motion, single steps are followed, and the velocity is uncertain by v itself.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.diagnosis.observations.whitening import RowWeighting
from tauscope.dynamics import smooth_sign
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.recording import Array

# What is left of the motion's velocity without the upper half of its band shows what the band itself does.
HALF_BAND = 0.5
ROUNDED = 0.8  # by which part of what half the band rounds a band itself may have rounded all reversals
# By which part of its period 1/f it may have moved them; the second where s f, up to which an encoder's steps s are
# followed, is as wide as friction's step 1/K_v.
MOVED = (0.03, 0.08)
# Part of u² that a row is held to be off by: on simulated arms that lack nothing, rows near reversals hold a twentieth
# to a fifth of it; what a band does to all of them alike is looked at apart.
REALISED = 0.15


def weightings_of_motion(observations: Observations, model: ExtendedModel) -> tuple[RowWeighting, ...]:
    """How much the whitened rows count beside a model that is right about friction, one entry a joint."""
    whole = observations.with_weightings(())
    weightings = []
    for joint in range(len(observations.noise)):
        weights = certainty(observations, model, joint, REALISED)
        weightings.append(RowWeighting.of(weights, shared_errors(whole, model, joint, weights)))
    return tuple(weightings)


def certainty(observations: Observations, model: ExtendedModel, joint: int, share: float) -> Array:
    """1 / √(1 + s u² / σ²) of every white row, (R,), beside a step known to u of which it is off by a `share` s."""
    noise = observations.noise[joint]
    parts = [_uncertain_power(piece, model, joint)[noise.order :] / noise.model.variance for piece in observations]
    return 1.0 / np.sqrt(1.0 + share * np.concatenate(parts)[observations.kept(joint)])


def shared_errors(observations: Observations, model: ExtendedModel, joint: int, weights: Array) -> Array:
    """What the band may have rounded and moved all reversals by, (2, R), among rows of `weights`, (R,)."""
    changes, slopes = [], []
    for piece in observations:
        motion = piece.prepared.motion
        friction = _steps(model, joint, motion.velocity[:, joint])
        changes.append(piece.reduced((_steps(model, joint, _narrow_velocity(piece, joint)) - friction)[None]))
        slopes.append(piece.reduced((np.gradient(friction) * motion.rate_hz)[None]))
    change, slope = (weights * observations.white(joint, rows)[0] for rows in (changes, slopes))
    delay = float(change @ slope) / max(float(slope @ slope), np.finfo(float).tiny)
    farthest = max(_farthest_moved(piece, model, joint) for piece in observations)
    return np.stack([ROUNDED * (change - delay * slope), farthest * slope])


def _farthest_moved(piece: Piece, model: ExtendedModel, joint: int) -> float:
    """By how much a band may have moved a joint's reversals [s]."""
    smooth_part, stepped_part = MOVED
    state_hz, steepness = float(piece.state_hz[joint]), model.structure.terms[joint].k_v or 0.0
    followed = min(steepness * float(piece.position_noise.step[joint]) * state_hz, 1.0)
    return (smooth_part + (stepped_part - smooth_part) * followed) / state_hz


def _uncertain_power(piece: Piece, model: ExtendedModel, joint: int) -> Array:
    """Variance of a row's friction, (M,) [Nm² or N²]."""
    motion = piece.prepared.motion
    velocity = motion.velocity[:, joint]
    rate, state_hz = motion.rate_hz, float(piece.state_hz[joint])
    crawl = piece.position_noise.step[joint] * state_hz
    noise = np.hypot(piece.velocity_std[joint], np.where(np.abs(velocity) < crawl, crawl, 0.0))
    narrow = _narrow_velocity(piece, joint)
    at_random = _step_error(model, joint, velocity, noise)
    rounded = _step_error(model, joint, velocity, np.abs(velocity - narrow))
    band = motion.band
    if not isinstance(band, Decimator):
        return at_random**2 + rounded**2
    squared = Decimator(band.kernel**2, band.factor, band.rate_hz)
    whole = Decimator(np.abs(band.kernel), band.factor, band.rate_hz)
    together = max(rate / (2.0 * state_hz), 1.0)  # samples that share one error of the velocity
    return together * squared.reduce(at_random**2) + whole.reduce(rounded) ** 2


def _narrow_velocity(piece: Piece, joint: int) -> Array:
    """A joint's velocity in half the motion's band, (N,)."""
    motion = piece.prepared.motion
    return smooth(motion.velocity[:, [joint]], motion.rate_hz, HALF_BAND * float(piece.state_hz[joint]))[:, 0]


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
