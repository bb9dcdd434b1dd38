"""The noise of every joint's rows, from the data and not from the fit.

Where motion repeats, what differs between repetitions is noise whatever the model lacks (pure error). Elsewhere the
residual of a saturated fit stands in for it: the nominal model and as many candidates as explain anything, so that a
left-out effect is not taken for the noise's colour and whitened away.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import full_torque, residual_rows
from tauscope.diagnosis.noise.pursuit import pursued
from tauscope.diagnosis.observations.observations import BoolArray, Observations
from tauscope.diagnosis.observations.period_pairs import period_pairs, rounding_repeats
from tauscope.diagnosis.observations.whitening import JointNoise, fitted_noise
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.effects import Effect
from tauscope.effects.computation import side_by_side
from tauscope.identification.autocorrelation import Autoregression
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array

FEWEST_ROWS = 150
"""Rows of pure error that a joint's noise model needs."""

FAR_ABOVE = 2.0
"""What even a saturated fit leaves, relative to the pure error's power, beyond which it is what counts: what nothing in
the catalogue explains is then the larger part of the disturbance, and has a colour of its own."""

NO_BETTER = 0.8
"""Part of what was left at a joint that is left without the rows of a worse one too, from which it is its own."""


def with_noise(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect]
) -> tuple[Observations, bool]:
    """The observations with their noise known, and whether it is pure error at every joint."""
    known = with_pure_error(observations, model)
    if known is None:
        told = _saturated_noise(observations, model, effects, _joints(observations))
        return observations.with_noise(list(told.values())), False
    return _beyond_pure_error(known, model, effects)


def with_pure_error(observations: Observations, model: ExtendedModel) -> Observations | None:
    """The observations with the noise that repetitions show; None where they are too few at some joint."""
    differences = [] if rounding_repeats(observations) else list(repeated_differences(observations, model))
    pure = [[(rows[j], used[j], factor) for rows, used, factor in differences] for j in _joints(observations)]
    if any(sum(int(used.sum()) for _, used, _ in parts) < FEWEST_ROWS for parts in pure):
        return None
    share = band_share(observations)
    return observations.with_noise([fitted_noise(parts, share) for parts in pure])


def repeated_differences(
    observations: Observations, model: ExtendedModel
) -> Iterator[tuple[Array, NDArray[np.bool_], float]]:
    """What the residual of a period differs by from that of the period before: noise, whatever the model lacks.

    Yields
    ------
    tuple of (n, M) float64, (n, M) bool and float
        rows in the common band, which of them rest on measured torque, and the factor that turns their power into the
        noise's
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


def _joints(observations: Observations) -> range:
    return range(observations.robot.joint_count)


def white_noise(observations: Observations, model: ExtendedModel, share: float = 1.0) -> list[JointNoise]:
    """White noise as large as all that a model leaves.

    Parameters
    ----------
    share : float
        independent rows among all
    """
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


def _saturated_noise(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect], joints: Iterable[int]
) -> dict[int, JointNoise]:
    """Noise of what a saturated fit leaves at some joints."""
    plain = white_noise(observations, model)
    left = _saturated(observations.with_noise(plain), model, effects, joints)
    share = band_share(observations)
    return {j: fitted_noise(_by_piece(observations, j, rows * plain[j].std), share) for j, rows in left.items()}


def _beyond_pure_error(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect]
) -> tuple[Observations, bool]:
    """Pure error where it is all that a saturated fit leaves; at the other joints, what that fit leaves."""
    fit = Fitter(observations).fit(model)
    if fit.inflation() < FAR_ABOVE:
        return observations, True
    far = _far_above(observations, fit.model, effects)
    if not far:
        return observations, True
    other = _saturated_noise(observations, fit.model, effects, sorted(far))
    noise = [
        replace(other[joint], over_repetitions=far[joint]) if joint in far else own
        for joint, own in enumerate(observations.noise)
    ]
    return observations.with_noise(noise), False


def _far_above(observations: Observations, model: ExtendedModel, effects: Sequence[Effect]) -> dict[int, float]:
    """Joints at which even a saturated fit leaves far more than repetitions differ by, and how much more.

    They share the links: what is wrong at one bends these, and others look wrong for it. So the worst is left out
    before the others are looked at again, and with it those that look no better for that.
    """
    far: dict[int, float] = {}
    suspects, before = _suspects(observations, model, effects, range(len(observations.noise))), {}
    while suspects:
        worst = max(suspects.values())
        far |= {j: left for j, left in suspects.items() if left == worst or left > NO_BETTER * before.get(j, np.inf)}
        others = suspects.keys() - far.keys()
        if not others:
            break
        rows = observations.without_joints(far)
        before, suspects = suspects, _suspects(rows, Fitter(rows).fit(model).model, effects, others)
    return far


def _suspects(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect], joints: Iterable[int]
) -> dict[int, float]:
    """Those of some joints at which a saturated fit leaves far more than the noise, and how much [noise variances]."""
    fit = Fitter(observations).projected(model)
    doubtful = [j for j in joints if _power(observations, j, fit.projection.residual[j]) > FAR_ABOVE]
    left = _saturated(observations, model, effects, doubtful)
    power = {joint: _power(observations, joint, rows) for joint, rows in left.items()}
    return {joint: own for joint, own in power.items() if own > FAR_ABOVE}


def _power(observations: Observations, joint: int, rows: Array) -> float:
    """Power of what is left at a joint [noise variances]."""
    return float(rows @ rows) / (len(rows) * observations.noise[joint].share)


def _saturated(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect], joints: Iterable[int]
) -> dict[int, Array]:
    """What the nominal model and the candidates together leave at some joints, whitened rows."""
    fit = Fitter(observations).projected(model)
    screen = Screen(observations, effects)
    signals = model_signals(model, observations)
    columns: dict[int, list[Array]] = {joint: [] for joint in joints}
    rough = [(effect, effect.rough_grid()) for effect in effects]
    told = [(effect, shapes) for effect, shapes in rough if len(shapes) and _touches(effect, columns, observations)]
    for white in side_by_side(lambda each: screen.white_columns(*each, signals), told):
        for joint in columns.keys() & white.keys():
            columns[joint].append(white[joint].reshape(-1, white[joint].shape[-1]))

    def left(joint: int) -> Array:
        basis, residual = fit.projection.basis[joint], fit.projection.residual[joint]
        every = np.concatenate(columns[joint]) if columns[joint] else np.zeros((0, len(residual)))
        return pursued(every - (every @ basis.T) @ basis, residual)

    return dict(zip(columns, side_by_side(left, columns), strict=True))


def _touches(effect: Effect, joints: Iterable[int], observations: Observations) -> bool:
    """Whether an effect is one of some joints."""
    return not set(effect.touched(observations.robot.joint_count)).isdisjoint(joints)


def _by_piece(observations: Observations, joint: int, rows: Array) -> Iterator[tuple[Array, BoolArray, float]]:
    """Rows of a joint that count, back in their pieces."""
    first = 0
    for piece in observations:
        used = piece.used[joint].ravel()
        spread = np.zeros(len(used))
        count = int(used.sum())
        spread[used] = rows[first : first + count]
        first += count
        yield spread, used, 1.0
