"""The bands of a diagnosis: the one in which torque and model are compared, and that of the motion itself.

An identification keeps to where its model explains more than it leaves. Where what is left out is most of the torque,
that band says nothing, and the diagnosis looks beyond it, as far as the noise of the positions allows.

Friction's step at a reversal has all frequencies. The motion is taken in a band of its own, several times as wide as
the comparison, so that the step is where it was: a comparison too near to that band sees its rounded corners.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.identification import Identification
from tauscope.identification.band import quiet_limit
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array

WIDENING = 4.0  # width over the identification's band where its model explains too little
LITTLE = 0.5  # share of the torque's variance that a model explains at least for its band to mean anything
NOISE_MARGIN = 0.8  # share of the band at which the positions' noise would show in the accelerations
WIDEST_HZ = 40.0  # beyond, arms do not move, and rows cost time
OPEN_SHARE = 0.3  # share of the sampling rate that is never exceeded
# Noise of the velocity, relative to the width 1/K_v of friction's step, up to which a joint's own band is opened.
# Narrower it rounds off how the joint sticks at its reversals, always to the same side, which looks like a delay or
# like bristles; wider its noise blurs the step to either side. The rows' weights know of both, but what tells
# asymmetric friction from a constant is lost in either: it is seen with a third more standard errors at 0.5 than at 1.
BLURRED = 0.5
AT_MOST_BLURRED = 1.0  # …and up to which it is opened where it would otherwise show corners of friction's steps, below
# …and up to which it is opened for what the torque is at single samples, where no band takes that noise out again.
QUIET = 0.4
STATE_BANDS = (2.0, 8.0)  # narrowest and widest band of the motion relative to the common one
# Width of the motion's own band, over that of the comparison, that shows no corners of friction's steps. Where noise
# alone sets the comparison, a joint's own band is opened that far.
STEPS_SEEN = 2.5


def diagnosis_cutoff(conditioners: Sequence[Conditioner], identification: Identification, steepness: Array) -> float:
    """Cut-off of the band that torque and columns share, by K_v of friction, `steepness`, (n,) [Hz]."""
    widest = _widest(conditioners)
    limit = quiet_limit(conditioners)
    quiet = widest if limit is None else min(widest, NOISE_MARGIN * limit)
    identified = identification.cutoff_hz
    if identified is None:
        return quiet
    if explained_share(conditioners, identification) < LITTLE:
        return max(min(quiet, WIDENING * identified), min(identified, widest))
    noisiest = min(c.noise.limit_hz or np.inf for c in conditioners)
    return min(identified, widest, max(noisiest, _without_corners(conditioners, steepness)))


def _widest(conditioners: Sequence[Conditioner]) -> float:
    """Band that is never exceeded [Hz]."""
    return min(WIDEST_HZ, OPEN_SHARE * min(conditioner.timing.rate_hz for conditioner in conditioners))


def _without_corners(conditioners: Sequence[Conditioner], steepness: Array) -> float:
    """Widest band that shows no corners of friction's steps where noise of the velocities may be `BLURRED` [Hz]."""
    return min(float(step_bands(conditioner, steepness, BLURRED).min()) for conditioner in conditioners) / STEPS_SEEN


def state_cutoffs(conditioner: Conditioner, cutoff_hz: float | None, steepness: Array) -> Array | None:
    """Cut-off of each joint's own smoothing, (n,) [Hz], by K_v, `steepness`, (n,); None for no filter."""
    if cutoff_hz is None:
        return None
    without_corners = np.minimum(STEPS_SEEN * cutoff_hz, step_bands(conditioner, steepness, AT_MOST_BLURRED))
    return _within(np.maximum(step_bands(conditioner, steepness, BLURRED), without_corners), cutoff_hz)


def quiet_cutoffs(conditioner: Conditioner, cutoff_hz: float | None, steepness: Array) -> Array | None:
    """The same, (n,) [Hz], for what the torque is at single samples, by K_v, `steepness`, (n,)."""
    if cutoff_hz is None:
        return None
    return _within(step_bands(conditioner, steepness, QUIET), cutoff_hz)


def _within(bands: Array, cutoff_hz: float) -> Array:
    """Bands, neither narrower nor wider than `STATE_BANDS` allow."""
    narrowest, widest = (ratio * cutoff_hz for ratio in STATE_BANDS)
    return np.clip(bands, narrowest, widest)


def step_bands(conditioner: Conditioner, steepness: Array, blurred: float) -> Array:
    """Bands in which noise of density D makes K_v √(D (2π)² f³/3), K_v `steepness`, (n,), of `blurred`, (n,) [Hz].

    There is no limit, and the band infinite, where a joint does not move or its positions have no noise.
    """
    density = conditioner.noise.density
    widths = 3.0 * (blurred / np.maximum(steepness, 1e-9)) ** 2 / (4.0 * np.pi**2)
    limited = conditioner.moving & (density > 0.0)
    return np.cbrt(np.divide(widths, density, out=np.full(len(widths), np.inf), where=limited))


def explained_share(conditioners: Sequence[Conditioner], identification: Identification) -> float:
    """Part of the torque's variance, over all joints, that a model explains."""
    values = [c.recording.joint_torque(s.effort, c.robot) for c in conditioners for s in c.usable_samples()]
    torque = np.concatenate(values)
    variance = float(np.nansum(np.nanvar(torque, axis=0)))
    left = float(np.sum(identification.residuals.fit.rms**2))
    return 1.0 - left / variance if variance > 0.0 else 0.0
