"""What noise of the positions puts into an elastic transmission's column and into the residual alike.

A motion that is known as q + n predicts a torque that is wrong by G n, and G n is missing in the residual. An
elasticity's column, or that of springy teeth, is made of that same torque, so that even where nothing is missing

    E[xᵀ M r] = E[(x(q + n) - x(q))ᵀ M (-G n)],        M = I - W W⁺,

is not zero. A transmission that follows its load at once gets a negative compliance from that, which cannot be; one
that resonates within the band turns the phase round, and gets a positive one. The expectation is taken over draws of n
with the spectrum of the encoder's noise in the band of the motion.
"""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import moments
from tauscope.diagnosis.observations.observations import Piece
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.selection.choice import Option
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import side_by_side
from tauscope.effects.deflection import torque_of_deflection
from tauscope.recording.conditioning.filters import smooth_each
from tauscope.recording.recording import Array

DRAWS = 4
"""Of the noise: the expectation is a sum over thousands of rows, and needs few."""

MOST = 1.0 / 3.0
"""Share of what a column has in common with the residual that noise may account for."""


def is_position_noise(option: Option, fit: Fit, screen: Screen) -> bool:
    """Whether noise of the positions accounts for more than `MOST` of what an effect that swings explains."""
    term = option.fit.model.terms[-1]
    if not term.effect.swings:
        return False
    signals = model_signals(fit.model, screen.observations)
    in_common = float(screen.at_shapes(term.effect, term.shape[None], fit, signals).target[0, 0])
    sources = [np.random.default_rng([0, number]) for number in range(DRAWS)]
    expected = np.mean(side_by_side(lambda rng: _drawn(term.effect, term.shape, fit, screen, signals, rng), sources))
    return bool(expected > MOST * in_common)


def _drawn(
    effect: Effect, shape: Array, fit: Fit, screen: Screen, signals: list[Signals], rng: np.random.Generator
) -> float:
    """(x(q + n) - x(q))ᵀ M (-G n) for one draw of n."""
    observations = screen.observations
    changes = [_predicted(own, _noise(piece, rng)) for piece, own in zip(observations, signals, strict=True)]
    moved = [
        replace(own, load=own.load + piece.without_noise_of_inertia(change))
        for piece, own, change in zip(observations, signals, changes, strict=True)
    ]
    rows = [piece.reduced(-change) for piece, change in zip(observations, changes, strict=True)]
    joints = range(len(rows[0]))
    residual = [observations.white(joint, [each[joint : joint + 1] for each in rows])[0] for joint in joints]
    beside = replace(fit.projection, residual=tuple(_projected(residual, fit)))
    noisy, plain = (screen.white_columns(effect, shape[None], each) for each in (moved, signals))
    changed = {joint: noisy[joint] - plain[joint] for joint in noisy}
    return float(moments(beside, changed).target[0, 0])


def _noise(piece: Piece, rng: np.random.Generator) -> Array:
    """Position noise of a draw in the band of the motion, (n, N) [rad or m]."""
    motion = piece.prepared.motion
    std = np.sqrt(0.5 * piece.position_noise.density * motion.rate_hz)
    white = std * rng.standard_normal(motion.position.shape)
    return np.ascontiguousarray(smooth_each(white, motion.rate_hz, piece.state_hz).T)


def _predicted(signals: Signals, noise: Array) -> Array:
    """Change of the predicted rigid torque with the positions' noise, (n, N): G n."""
    return -np.sum([torque_of_deflection(signals, joint, own) for joint, own in enumerate(noise)], axis=0)


def _projected(residual: list[Array], fit: Fit) -> list[Array]:
    """M r, (R_j,) a joint."""
    basis = fit.projection.basis
    inner = np.sum([own @ row for own, row in zip(basis, residual, strict=True)], axis=0)
    return [row - inner @ own for own, row in zip(basis, residual, strict=True)]
