"""How well recordings tell explanations apart, and how well they know parameters: before anything is recorded.

Two models, each fitted, predict torques that differ by Δ. What the other's own parameters J cannot imitate of it,

    λ = ‖(1 - J J⁺) Δ‖²        (whitened rows, old recordings and the new one together),

is the noncentrality with which a test between them works: T-optimality (Atkinson and Fedorov 1975).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.regressor_noise import weightings_of_motion
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.conditioning.position_noise import PositionNoise
from tauscope.recording.recording import Array
from tauscope.trajectory import Trajectory

UNKNOWN = 1e-9  # singular values of the scaled columns below this share of the largest tell nothing


def played(trajectory: Trajectory, observations: Observations, model: ExtendedModel, cutoff_hz: float) -> Fitter:
    """A motion sampled as the recordings were and conditioned as they were, in a band [Hz], without torque."""
    robot, rate = observations.robot, observations.pieces[0].prepared.motion.rate_hz
    samples = trajectory.samples(rate)
    position = _measured(samples.position, [piece.position_noise for piece in observations], rate)
    recording = Recording.from_arrays("planned", samples.time, position, np.zeros_like(position))
    conditioner = Conditioner.survey(recording, robot)
    rows = Observations.prepare([conditioner], robot, model.structure.base, cutoff_hz, model.steepness)
    number = len(observations.names)  # later than all that were recorded
    pieces = tuple(replace(piece, prepared=replace(piece.prepared, recording=number)) for piece in rows)
    rows = replace(rows, pieces=pieces).with_noise(observations.noise)
    return Fitter(rows.with_weightings(weightings_of_motion(rows, model)))


def _measured(position: Array, noises: Sequence[PositionNoise], rate_hz: float) -> Array:
    """Positions as the arm's encoders told them where they were worst, (N, n): exact ones could show more."""
    density = np.max([noise.density for noise in noises], axis=0)
    step = np.max([noise.step for noise in noises], axis=0)
    std = np.sqrt(np.maximum(density * rate_hz / 2.0 - np.square(step) / 12.0, 0.0))
    noisy = position + std * np.random.default_rng(0).standard_normal(position.shape)
    rounds = step > 0.0
    divisor = np.where(rounds, step, 1.0)
    return np.where(rounds, np.rint(noisy / divisor) * divisor, noisy)


def equations(
    model: ExtendedModel, fitter: Fitter, others: Sequence[ExtendedModel] = (), absent: int | None = None
) -> Array:
    """Whitened columns, zero for an `absent` one, and differences to other models' torque, as few rows, (r, p + o)."""
    own = fitter.white_residual(model)
    differences = [
        [mine - theirs for mine, theirs in zip(own, fitter.white_residual(other), strict=True)] for other in others
    ]
    blocks = []
    for joint, columns in enumerate(fitter.columns(model)):
        beside = np.array([difference[joint] for difference in differences]).reshape(len(others), columns.rows.shape[1])
        triangle = np.asarray(np.linalg.qr(np.concatenate([columns.rows, beside]).T, mode="r"))
        block = np.zeros((len(triangle), model.size + len(others)))
        block[:, columns.index] = triangle[:, : len(columns.index)]
        block[:, model.size :] = triangle[:, len(columns.index) :]
        blocks.append(block)
    found = np.concatenate(blocks)
    if absent is not None:
        found[:, absent] = 0.0
    return found


def separations(model: ExtendedModel, stacked: Array) -> Array:
    """λ of each other model, (o,): what columns leave of the differences in `stacked` equations, (r, p + o)."""
    prior, _ = model.prior()
    columns = np.concatenate([stacked[:, : model.size], prior])
    differences = np.concatenate([stacked[:, model.size :], np.zeros((len(prior), stacked.shape[1] - model.size))])
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    left, singular, _ = np.linalg.svd(columns / scale, full_matrices=False)
    known = left[:, singular > UNKNOWN * singular[0]]
    return np.sum((differences - known @ (known.T @ differences)) ** 2, axis=0)


def log_variances(model: ExtendedModel, stacked: Array) -> Array:
    """Log variance of every parameter, (p,), by `stacked` equations, (r, p); large where nothing is known of it."""
    prior, _ = model.prior()
    columns = np.concatenate([stacked, prior])
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    _, singular, right = np.linalg.svd(columns / scale, full_matrices=False)
    floor = UNKNOWN * singular[0]
    return np.log(np.sum((right.T / np.maximum(singular, floor)) ** 2, axis=1)) - 2.0 * np.log(scale)
