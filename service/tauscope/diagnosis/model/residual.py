"""What a model leaves of the torque that was measured: in the band that both share, and at the recorded rate."""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import BoolArray, Observations, Piece
from tauscope.dynamics import smooth_sign
from tauscope.effects import Signals
from tauscope.identification.dataset import MOSTLY
from tauscope.recording.conditioning.filters import smooth_each
from tauscope.recording.recording import Array


def predicted_rows(model: ExtendedModel, piece: Piece) -> Array:
    """The model's torque in the common band, all repetitions, (n, P M)."""
    total = np.array(piece.repeated(piece.prepared.predicted_rows(model.structure, model.parameters)))
    for term in model.terms:
        touched = list(term.effect.touched(len(total)))
        total[touched] += piece.reduced(model.term_torque(term, model.signals(piece)))
    return total


def full_torque(model: ExtendedModel, piece: Piece) -> Array:
    """The model's torque at the recorded rate, of the first repetition where they differ, (n, N)."""
    signals = model.signals(piece)
    total = signals.torque.copy()
    for term in model.terms:
        torque = model.term_torque(term, signals)
        total[list(term.effect.touched(len(total)))] += torque if torque.ndim == 2 else torque[:, 0]
    return total


def residual_rows(model: ExtendedModel, observations: Observations) -> list[list[Array]]:
    """Measured less modelled torque in the common band: per joint, per piece, (1, P M)."""
    predicted = [predicted_rows(model, piece) for piece in observations]
    joints = range(observations.robot.joint_count)
    return [
        [measured - rows[joint] for measured, rows in zip(observations.torque(joint), predicted, strict=True)]
        for joint in joints
    ]


def raw_squares(model: ExtendedModel, observations: Observations) -> tuple[Array, Array]:
    """Squared errors at the recorded rate, (n, N), summed over repetitions, and samples of every joint, (n,).

    Nothing is filtered; pieces follow each other, and what was not measured counts zero. Nor does a joint at rest:
    there friction takes any value up to breakaway, and no model knows which.
    """
    count = observations.robot.joint_count
    squares, samples = [], np.zeros(count)
    for piece in observations:
        signals, motion = _quiet(model.signals(piece), piece, model), piece.prepared.motion
        predicted = np.repeat(signals.torque[:, None], piece.repetitions, axis=1)
        for term in model.terms:
            torque = term.effect.torque_of(signals, term.coefficients, term.shape)
            predicted[list(term.effect.touched(count))] += torque if torque.ndim == 3 else torque[:, None]
        own = motion.own
        measured = motion.torque[:, own].transpose(2, 0, 1)
        known = motion.measured[:, own].transpose(2, 0, 1) & _moving(piece)[:, None, own]
        error = np.where(known, measured - predicted[..., own], 0.0)
        squares.append(np.einsum("jpt,jpt->jt", error, error))
        samples += known.sum(axis=(1, 2))
    return np.concatenate(squares, axis=1), samples


def _moving(piece: Piece) -> BoolArray:
    """Which samples of every joint are of no stop, (n, N); all of a joint that never moves."""
    instants = piece.row_times()[: piece.rows]
    resting = [np.interp(piece.time[0], instants, rows) for rows in piece.prepared.at_rest]
    moving = np.array(resting) < MOSTLY
    return np.where(moving.any(axis=1, keepdims=True), moving, True)


def _quiet(signals: Signals, piece: Piece, model: ExtendedModel) -> Signals:
    """The same motion as it is known best at single samples: there, no band takes the noise out of friction's step."""
    if piece.quiet_hz is None:
        return signals
    structure, torque = model.structure, signals.load.copy()
    velocity = smooth_each(signals.velocity.T, signals.rate_hz, piece.quiet_hz).T
    for joint in range(len(torque)):
        own = structure.joint_term_columns(joint, velocity[joint], signals.acceleration[joint])
        torque[joint] += model.parameters[structure.joint_columns(joint)[-len(own) :]] @ own
    step = smooth_sign(velocity, model.steepness[:, None])
    return replace(signals, velocity=velocity, torque=torque, step=step, of_motion={}, _memory={})
