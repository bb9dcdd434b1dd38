"""What a hypothesis predicts of motion that it has not seen, joint by joint."""

from dataclasses import dataclass, field

import numpy as np

from tauscope.diagnosis.evidence.rows import find_rest
from tauscope.diagnosis.evidence.scales import REST_BOUNDS
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
        pairs = zip(self._errors(before.model), self._errors(after.model), strict=True)
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

    def _errors(self, model: ExtendedModel) -> list[Array]:
        """Measured less predicted torque of every joint, (R,)."""
        return self._known.get(id(model), lambda: (model, self._make_errors(model)))[1]

    def _make_errors(self, model: ExtendedModel) -> list[Array]:
        rows = residual_rows(model, self.observations)
        return [
            np.concatenate([own[0] for own in each])[self.observations.kept(joint)] for joint, each in enumerate(rows)
        ]
