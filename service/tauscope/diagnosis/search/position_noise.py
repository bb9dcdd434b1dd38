"""Noise of the positions that looks like an elastic transmission.

A motion that is known as q + n predicts a torque that is wrong by G n, and G n is missing in the residual. The column x
of an elasticity, or of springy teeth, is made of that same torque, so that even where nothing is missing

    E[xᵀ M r] = E[(x(q + n) - x(q))ᵀ M (-G n)],        M = I - W W⁺,

is not zero. A transmission that follows its load at once gets a negative compliance from that, which cannot be; one
that resonates within the band turns the phase round, and gets a positive one. The expectation is taken over draws of n
with the spectrum of the encoder's noise in the band of the motion.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.projection import Projection, moments, project
from tauscope.diagnosis.fitting.white_columns import WhiteColumns, white_columns
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.effects import Effect, Signals
from tauscope.effects.deflection import torque_of_deflection
from tauscope.recording.conditioning.filters import smooth_each
from tauscope.recording.recording import Array

DRAWS = 4  # of the noise: the expectation is a sum over thousands of rows, and needs few
MOST = 1.0 / 3.0  # share of what a column has in common with the residual that noise may account for


def is_position_noise(
    effect: Effect, shape: Array, model: ExtendedModel, observations: Observations, signals: Sequence[Signals]
) -> bool:
    """Whether noise of the positions accounts for more than `MOST` of what an effect of `shape`, (k,), explains."""
    white = WhiteColumns(observations)
    beside = project(white.all(model), white.residual(model), model.size)
    plain = white_columns(observations, effect, shape[None], signals)
    in_common = float(moments(beside, plain).target[0, 0])
    expected = 0.0
    for number in range(DRAWS):
        rng = np.random.default_rng([0, number])
        changes = [_predicted(own, _noise(piece, rng)) for piece, own in zip(observations, signals, strict=True)]
        moved = [
            replace(own, load=own.load + piece.without_noise_of_inertia(change))
            for piece, own, change in zip(observations, signals, changes, strict=True)
        ]
        noisy = white_columns(observations, effect, shape[None], moved)
        missing = replace(beside, residual=_missing(observations, changes, beside))
        expected += float(moments(missing, {joint: noisy[joint] - plain[joint] for joint in plain}).target[0, 0])
    return expected > MOST * DRAWS * in_common


def _missing(observations: Observations, changes: Sequence[Array], beside: Projection) -> tuple[Array, ...]:
    """-M G n, white, (R_j,) a joint."""
    rows = [piece.reduced(-change) for piece, change in zip(observations, changes, strict=True)]
    white = [observations.white(joint, [each[[joint]] for each in rows])[0] for joint in range(len(rows[0]))]
    inner = np.sum([own @ row for own, row in zip(beside.basis, white, strict=True)], axis=0)
    return tuple(row - inner @ own for own, row in zip(beside.basis, white, strict=True))


def _noise(piece: Piece, rng: np.random.Generator) -> Array:
    """Position noise of a draw in the band of the motion, (n, N) [rad or m]."""
    motion = piece.prepared.motion
    std = np.sqrt(0.5 * piece.position_noise.density * motion.rate_hz)
    white = std * rng.standard_normal(motion.position.shape)
    return np.ascontiguousarray(smooth_each(white, motion.rate_hz, piece.state_hz).T)


def _predicted(signals: Signals, noise: Array) -> Array:
    """Change of the predicted rigid torque with the positions' noise, (n, N): G n."""
    return -np.sum([torque_of_deflection(signals, joint, own) for joint, own in enumerate(noise)], axis=0)
