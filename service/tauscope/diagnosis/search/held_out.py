"""What a hypothesis predicts of motion that it has not seen, joint by joint."""

from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.evidence.rows import find_rest
from tauscope.diagnosis.evidence.scales import REST_BOUNDS, Scales
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.recording.recording import Array

BLOCKS = 24
"""Stretches of motion by which the standard error of a change is told."""

SHORTEST = 8
"""Rows of a stretch, at least: errors of neighbouring rows are alike."""


@dataclass(frozen=True, eq=False)
class Change:
    """How much better one hypothesis predicts than another.

    relative : (n,) float64
        change of every joint's rms, rows near rest counting as little as the covariance says; below zero is better
    error : (n,) float64
        its standard error
    gain : (n,) float64
        log density that the better prediction gains, of rows that are as dependent as the noise
    """

    relative: Array
    error: Array
    gain: Array

    @property
    def standard(self) -> Array:
        """Change in standard errors, (n,); zero where nothing changed."""
        return np.divide(self.relative, self.error, out=np.zeros_like(self.relative), where=self.error > 0.0)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out recordings in the band of the training rows; their rows are not whitened."""

    observations: Observations

    def change(self, before: Hypothesis, after: Hypothesis) -> Change:
        """What a second hypothesis predicts better than a first."""
        pairs = zip(self._errors(before.model), self._errors(after.model), strict=True)
        found = [
            self._compare_joint(joint, *errors, after.model, scales)
            for joint, (errors, scales) in enumerate(zip(pairs, after.scales, strict=True))
        ]
        relative, error, gain = np.array(found).T
        return Change(relative, error, gain)

    def _errors(self, model: ExtendedModel) -> list[Array]:
        """Measured less predicted torque of every joint, (R,)."""
        return [np.concatenate([rows[0] for rows in pieces]) for pieces in residual_rows(model, self.observations)]

    def _compare_joint(
        self, joint: int, before: Array, after: Array, model: ExtendedModel, scales: Scales
    ) -> tuple[float, float, float]:
        near, stopped = find_rest(self.observations, model, joint)
        kept = self.observations.kept(joint)
        counted = np.where(stopped, 0.0, scales.weights()[np.digitize(near, REST_BOUNDS)])
        first, second = counted * before[kept] ** 2, counted * after[kept] ** 2
        whole = float(first.sum())
        if whole <= 0.0:
            return 0.0, 0.0, 0.0
        stretches = max(min(BLOCKS, len(first) // SHORTEST), 1)
        sums = np.array([part.sum() for part in np.array_split(second - first, stretches)])
        change = np.sqrt(max(float(second.sum()), 0.0) / whole) - 1.0
        error = float(np.sqrt(stretches) * sums.std(ddof=1)) / (2.0 * whole) if stretches > 1 else 0.0
        rows = float(np.count_nonzero(counted))
        return float(change), error, -rows * float(np.log1p(change))
