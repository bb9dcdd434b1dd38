"""The noise of every joint's rows, from the data and not from the fit.

Where motion repeats, what differs between repetitions is noise whatever the model lacks (pure error). Elsewhere the
residual of a saturated fit stands in for it: the nominal model and as many candidates as explain anything, so that a
left-out effect is not taken for the noise's colour and whitened away.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from service.diagnosis.catalogue import Effect
from service.diagnosis.fit import Fitter
from service.diagnosis.model import ExtendedModel, residual_rows
from service.diagnosis.observations import BoolArray, Observations, Piece
from service.diagnosis.screening import Screen, model_signals
from service.diagnosis.whitening import JointNoise, fitted_noise
from service.identification.autocorrelation import Autoregression
from service.recording.recording import Array

FEWEST_ROWS = 200
"""Rows of pure error that a joint's noise model needs."""

MOST_ADDED = 40
"""Columns of the catalogue in a saturated fit at most, and not more than one in `ROWS_A_COLUMN` rows."""

ROWS_A_COLUMN = 25


FAR_ABOVE = 2.0
"""What even a saturated fit leaves, relative to the pure error's power, beyond which it is what counts: what nothing in
the catalogue explains is then the larger part of the disturbance, and has a colour of its own."""


def with_noise(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect]
) -> tuple[Observations, bool]:
    """The observations with their noise known, and whether it is pure error at every joint.

    Parameters
    ----------
    observations : Observations
        the data
    model : ExtendedModel
        the nominal model, fitted
    effects : sequence of Effect
        the catalogue, for the saturated fit
    """
    residual = residual_rows(model, observations)
    joints = range(observations.robot.joint_count)
    pure = [list(_pure_error(observations, rows, joint)) for joint, rows in enumerate(residual)]
    if all(sum(int(used.sum()) for _, used, _ in parts) >= FEWEST_ROWS for parts in pure):
        noise = [fitted_noise(parts) for parts in pure]
        return _beyond_pure_error(observations.with_noise(noise), model, effects)
    plain = []
    for joint in joints:
        power = float(np.mean(np.concatenate([rows[0] for rows in residual[joint]]) ** 2)) + np.finfo(float).tiny
        plain.append(JointNoise(Autoregression(np.empty(0), power, power)))
    left = _saturated(observations.with_noise(plain), model, effects)
    noise = [fitted_noise(_by_piece(observations, j, rows * plain[j].std)) for j, rows in enumerate(left)]
    return observations.with_noise(noise), False


def _beyond_pure_error(
    observations: Observations, model: ExtendedModel, effects: Sequence[Effect]
) -> tuple[Observations, bool]:
    """Pure error where it is all that a saturated fit leaves; at the other joints, what that fit leaves."""
    fit = Fitter(observations).fit(model)
    if fit.inflation() < FAR_ABOVE:
        return observations, True
    left = _saturated(observations, fit.model, effects)
    far = [float(rows @ rows) / len(rows) > FAR_ABOVE for rows in left]
    if not any(far):
        return observations, True
    white, _ = with_noise(replace(observations, pieces=_single(observations)), fit.model, effects)
    noise = [b if is_far else a for a, b, is_far in zip(observations.noise, white.noise, far, strict=True)]
    return observations.with_noise(noise), False


def _single(observations: Observations) -> tuple[Piece, ...]:
    """The pieces with the mean of their repetitions: what repeats is no noise there."""
    pieces = []
    for piece in observations:
        used = piece.used.any(axis=1, keepdims=True)
        count = np.maximum(piece.used.sum(axis=1, keepdims=True), 1)
        mean = np.where(piece.used, piece.torque, 0.0).sum(axis=1, keepdims=True) / count
        pieces.append(replace(piece, torque=mean, used=used, time=piece.time[:1]))
    return tuple(pieces)


def _pure_error(
    observations: Observations, rows: Sequence[Array], joint: int
) -> Iterator[tuple[Array, BoolArray, float]]:
    """What differs between repetitions, scaled to the power of the noise."""
    for piece, each in zip(observations, rows, strict=True):
        if piece.repetitions > 1:
            residual = each.reshape(piece.repetitions, piece.rows)
            used = piece.used[joint]
            known = used.all(axis=0)
            deviation = residual - residual.mean(axis=0)
            factor = piece.repetitions / (piece.repetitions - 1.0)
            for repetition in deviation:
                yield repetition, known, factor


def _saturated(observations: Observations, model: ExtendedModel, effects: Sequence[Effect]) -> list[Array]:
    """What the nominal model and the candidates together leave, whitened rows joint by joint."""
    fit = Fitter(observations).projected(model)
    screen = Screen(observations, effects)
    signals = model_signals(model, observations)
    columns: dict[int, list[Array]] = {joint: [] for joint in range(observations.robot.joint_count)}
    for effect in effects:
        for joint, white in screen.white_columns(effect, effect.grid, signals).items():
            columns[joint].append(white.reshape(-1, white.shape[-1]))
    left = []
    for joint, parts in columns.items():
        basis, residual = fit.projection.basis[joint], fit.projection.residual[joint]
        every = np.concatenate(parts) if parts else np.zeros((0, len(residual)))
        left.append(_pursued(every - (every @ basis.T) @ basis, residual))
    return left


def _pursued(columns: Array, residual: Array) -> Array:
    """The residual after orthogonal matching pursuit, as long as columns explain more than chance allows."""
    norms = np.linalg.norm(columns, axis=1)
    columns = columns[norms > 1e-9 * max(norms.max(initial=0.0), 1e-300)]
    if not len(columns):
        return residual
    columns = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    best_of_many = 2.0 * np.log(len(columns))
    chance = best_of_many + 6.0
    left, taken = residual, 0
    for _ in range(min(MOST_ADDED, len(residual) // ROWS_A_COLUMN)):
        scores = columns @ left
        best = int(np.argmax(np.abs(scores)))
        if scores[best] ** 2 < chance * float(left @ left) / len(left):
            break
        taken += 1
        chosen = columns[best].copy()
        left = left - scores[best] * chosen
        columns -= np.outer(columns @ chosen, chosen)
        norms = np.linalg.norm(columns, axis=1)
        columns = columns[norms > 1e-2]
        if not len(columns):
            break
        columns /= np.linalg.norm(columns, axis=1, keepdims=True)
    # Each column, chosen among many, took this much noise with it.
    return left * np.sqrt(len(left) / max(len(left) - best_of_many * taken, 0.2 * len(left)))


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
