"""What a hypothesis predicts of motion that it has not seen, joint by joint.

Its parameters are as uncertain as training leaves them, so each stretch s of the motion is predicted from training and
from all other stretches: with residual r and slopes L of a stretch's rows, and Σ of training,

    δ_s = argmin δᵀ Σ⁻¹ δ + Σ_{t ≠ s} |r_t - L_t δ|²/κσ²,        error of stretch s: r_s - L_s δ_s.

Where training tells the parameters, δ is nothing. Where it does not, what they may do says nothing of physics, and no
coefficient gains by being fitted to what it is judged by.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tauscope.diagnosis.evidence.rows import find_rest, weigh_rows
from tauscope.diagnosis.evidence.scales import REST_BOUNDS
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.held_out_change import STRETCHES, HeldOutChange, stretches, sum_stretches
from tauscope.diagnosis.model.residual import raw_squares
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.effects.computation import LastFew
from tauscope.recording.recording import Array

KEPT = 16  # hypotheses whose errors are kept: each is compared with several others


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out recordings in the band of the training rows; their rows are not whitened."""

    observations: Observations
    _known: LastFew[int, tuple[Hypothesis, list[Array]]] = field(default_factory=lambda: LastFew(KEPT))

    def change(self, before: Hypothesis, after: Hypothesis) -> HeldOutChange:
        """What a second hypothesis predicts better than a first from training and all other stretches."""
        return self._compare(self._errors(before), self._errors(after), after)

    def trained_change(self, before: Hypothesis, after: Hypothesis) -> HeldOutChange:
        """…from training alone."""
        return self._compare(self._white.residual(before.model), self._white.residual(after.model), after)

    def delivered_change(self, before: Hypothesis, after: Hypothesis) -> HeldOutChange:
        """…at the recorded rate, every row of motion alike: what a user of the model gets, and a table says."""
        sums = (sum_stretches(raw_squares(each.model, self.observations)[0]) for each in (before, after))
        return HeldOutChange.between(*sums)

    def _compare(self, before: Sequence[Array], after: Sequence[Array], at: Hypothesis) -> HeldOutChange:
        """From the errors of every joint; rows near rest count as little as the scales of a hypothesis say."""
        found = [
            HeldOutChange.between(
                *sum_stretches(self._weights(joint, at) * np.square([*pair, pair[0] - pair[1]]))[:, None]
            )
            for joint, pair in enumerate(zip(before, after, strict=True))
        ]
        return HeldOutChange(
            *(np.concatenate([getattr(each, name) for each in found]) for name in ("relative", "error", "expected"))
        )

    def _weights(self, joint: int, at: Hypothesis) -> Array:
        """How much each row of a joint counts, (R,): as little as in training near rest and beside friction's step."""
        near, _ = find_rest(self.observations, at.model, joint)
        weights = at.scales[joint].weights()[np.digitize(near, REST_BOUNDS)]
        return weights * weigh_rows(self.observations, at.model, joint, at.scales[joint].noise) ** 2

    def _errors(self, at: Hypothesis) -> list[Array]:
        """Measured less predicted torque of every joint, (R,)."""
        return self._known.get(id(at), lambda: (at, self._make_errors(at)))[1]

    def _make_errors(self, at: Hypothesis) -> list[Array]:
        columns, residuals = self._white.all(at.model), self._white.residual(at.model)
        root = at.posterior.scale[:, None] * at.posterior.factor
        precision = root @ root.T
        left_out = np.zeros((STRETCHES, len(root), len(root) + 1))
        for joint, (own, residual) in enumerate(zip(columns, residuals, strict=True)):
            weights = self._weights(joint, at) / at.dependence[joint]
            for stretch, rows in zip(left_out, stretches(len(residual)), strict=False):
                weighted = weights[rows] * own.rows[:, rows]
                stretch[np.ix_(own.index, own.index)] += weighted @ own.rows[:, rows].T
                stretch[own.index, -1] += weighted @ residual[rows]
        matrices = precision + left_out[..., :-1].sum(axis=0) - left_out[..., :-1]
        steps = np.linalg.solve(matrices, left_out[..., -1:].sum(axis=0) - left_out[..., -1:])[..., 0]
        errors = [residual.copy() for residual in residuals]
        for own, error in zip(columns, errors, strict=True):
            for step, rows in zip(steps, stretches(len(error)), strict=False):
                error[rows] -= step[own.index] @ own.rows[:, rows]
        return errors

    @cached_property
    def _white(self) -> WhiteColumns:
        return WhiteColumns(self.observations)
