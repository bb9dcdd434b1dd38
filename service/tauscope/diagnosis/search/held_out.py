"""What a hypothesis predicts of motion that it has not seen, joint by joint.

Its parameters are as uncertain as training leaves them: their most probable values given the held-out rows r, too,
minimise |r - L δ|²/κσ² + δᵀ Σ⁻¹ δ. Where training tells them, δ is nothing. Where it does not, what they may do says
nothing of physics.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tauscope.diagnosis.evidence.rows import find_rest
from tauscope.diagnosis.evidence.scales import REST_BOUNDS
from tauscope.diagnosis.fitting.fit import stepped
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.held_out_change import HeldOutChange, sum_stretches
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.effects.computation import LastFew
from tauscope.recording.recording import Array

MODELS_KEPT = 16
"""Models whose errors are kept: each is compared with several others."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out recordings in the band of the training rows; their rows are not whitened."""

    observations: Observations
    _known: LastFew[int, tuple[ExtendedModel, list[Array]]] = field(default_factory=lambda: LastFew(MODELS_KEPT))

    def change(self, before: Hypothesis, after: Hypothesis) -> HeldOutChange:
        """What a second hypothesis predicts better than a first; rows near rest count as little as its scales say."""
        pairs = zip(self._errors(before), self._errors(after), strict=True)
        found = [
            HeldOutChange.between(*sum_stretches(self._weights(joint, after) * np.square(errors))[:, None])
            for joint, errors in enumerate(pairs)
        ]
        relative, error = (np.concatenate([getattr(each, name) for each in found]) for name in ("relative", "error"))
        return HeldOutChange(relative, error)

    def _weights(self, joint: int, at: Hypothesis) -> Array:
        """How much each row of a joint counts, (R,): none of a stop."""
        near, stops = find_rest(self.observations, at.model, joint)
        weights = at.scales[joint].weights()[np.digitize(near, REST_BOUNDS)]
        return np.where(stops > 0, 0.0, weights)

    def _errors(self, at: Hypothesis) -> list[Array]:
        """Measured less predicted torque of every joint, (R,)."""
        return self._known.get(id(at.model), lambda: (at.model, self._make_errors(at)))[1]

    def _make_errors(self, at: Hypothesis) -> list[Array]:
        pieces = residual_rows(stepped(at.model, self._update(at)), self.observations)
        rows = [np.concatenate([piece[0] for piece in own]) for own in pieces]
        return [own[self.observations.kept(joint)] for joint, own in enumerate(rows)]

    def _update(self, at: Hypothesis) -> Array:
        """δ, (p,)."""
        root = at.posterior.scale[:, None] * at.posterior.factor
        matrix, right = root @ root.T, np.zeros(len(root))
        pairs = zip(self._white.all(at.model), self._white.residual(at.model), strict=True)
        for joint, (own, residual) in enumerate(pairs):
            weighted = own.rows * (self._weights(joint, at) / at.dependence[joint])
            matrix[np.ix_(own.index, own.index)] += weighted @ own.rows.T
            right[own.index] += weighted @ residual
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)

    @cached_property
    def _white(self) -> WhiteColumns:
        return WhiteColumns(self.observations)
