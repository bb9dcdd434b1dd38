"""What a hypothesis predicts of motion that it has not seen, joint by joint."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tauscope.diagnosis.evidence.rows import find_rest
from tauscope.diagnosis.evidence.scales import REST_BOUNDS, Scales
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.effects.computation import LastFew
from tauscope.recording.recording import Array

MODELS_KEPT = 16
"""Models whose errors are kept: each is compared with several others."""

BLOCKS = 24
"""Stretches of motion by which the standard error of a change is told."""

SHORTEST = 8
"""Rows of a stretch, at least: errors of neighbouring rows are alike."""


WORSE = 2.0
"""Standard errors by which a joint is clearly predicted worse."""

SPILLED = 1.0 / 3.0
"""Part of the gain of all joints that others may lose."""


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

    @property
    def harm(self) -> float:
        """What joints lose that are clearly predicted worse, beyond a small part of what all others gain [log rms].

        All joints share the links. What is believed of these moves with an effect, and other joints with it.
        """
        gain = np.log1p(self.relative)
        lost = float(gain[(self.standard > WORSE) & (gain > 0.0)].sum())
        return lost + SPILLED * float(np.minimum(gain, 0.0).sum()) if lost > 0.0 else 0.0

    def loss(self, joints: Sequence[int]) -> float:
        """Change of some joints together, in standard errors."""
        return float(self.standard[list(joints)].sum() / np.sqrt(len(joints)))

    @property
    def log_odds(self) -> float:
        """Log odds that held-out motion adds to the second hypothesis, 2 z² of each joint.

        Where a torque f is there, leaving it out costs Σ f² ± 2σ √(κ Σ f²) in white noise σ whose rows count as 1/κ:
        z = √(Σ f²/κ) / 2σ, and Σ f² / 2κσ² is the log odds. So the noise need not be known.
        """
        return -2.0 * float(np.sum(self.standard * np.abs(self.standard)))


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out recordings in the band of the training rows; their rows are not whitened."""

    observations: Observations
    _known: LastFew[int, tuple[ExtendedModel, list[Array]]] = field(default_factory=lambda: LastFew(MODELS_KEPT))

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
        return self._known.get(id(model), lambda: (model, self._make_errors(model)))[1]

    def _make_errors(self, model: ExtendedModel) -> list[Array]:
        return [np.concatenate([rows[0] for rows in pieces]) for pieces in residual_rows(model, self.observations)]

    def _compare_joint(
        self, joint: int, before: Array, after: Array, model: ExtendedModel, scales: Scales
    ) -> tuple[float, float, float]:
        near, stops = find_rest(self.observations, model, joint)
        kept = self.observations.kept(joint)
        counted = np.where(stops > 0, 0.0, scales.weights()[np.digitize(near, REST_BOUNDS)])
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
