"""Log Bayes factors of many shapes of an effect at once, beside a hypothesis whose scales stay.

With a = XᵀC⁻¹Φ, u = Φᵀ C⁻¹ (y - X Θ̂) and B = ΦᵀC⁻¹Φ - aᵀ A⁻¹ a of a shape's columns Φ, coefficients N(0, S²) give

    log BF = ½ uᵀ (B + S⁻²)⁻¹ u - ½ log det(1 + S B S).

The size S is not known: it is a share κ of the joint's torque, equally likely each of `SIZES`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from tauscope.diagnosis.evidence.linear_model import Posterior
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.fitting.projection import INVISIBLE
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.effects import Effect, TimeLocalEffect
from tauscope.recording.recording import Array

# Rms of an effect's torque that is believed possible, as share of the joint's measured torque.
SIZES = np.array([0.01, 0.03, 0.1, 0.3, 1.0])


@dataclass(frozen=True, eq=False)
class Scored:
    """Shapes of an effect."""

    effect: Effect
    shapes: Array
    log_factors: Array  # (s,), log Bayes factor against the hypothesis without it; -inf where no such effect can be
    coefficients: Array  # (s, c), most probable values
    sizes: Array  # (s, c), standard deviations under which they are

    @property
    def best(self) -> int:
        """Place of the most probable shape."""
        return int(np.argmax(self.log_factors))

    def best_of_each_form(self) -> list[int]:
        """Places of the most probable shape for each set of values that no step changes; the best where none is."""
        effect = self.effect
        fixed = [place for place in range(len(effect.shapes)) if not effect.is_free(place)]
        if not fixed or isinstance(effect, TimeLocalEffect):
            return [self.best]
        _, forms = np.unique(self.shapes[:, fixed], axis=0, return_inverse=True)
        places = (np.flatnonzero(forms == form) for form in np.unique(forms))
        best = (int(own[np.argmax(self.log_factors[own])]) for own in places)
        return [place for place in best if np.isfinite(self.log_factors[place])]

    @property
    def log_evidence(self) -> float:
        """Log Bayes factor of the effect, every shape of the grid being as likely as another before."""
        return float(logsumexp(self.log_factors)) - float(np.log(len(self.log_factors)))


class Scorer:
    """Scores effects beside one hypothesis, with its discrepancy and with none."""

    def __init__(self, rows: EvidenceRows, at: Hypothesis) -> None:
        self._rows, self._at = rows, at
        self._plain = _without_discrepancy(at)
        self._settings = [(scales, at.linear.posterior(scales)) for scales in (at.scales, self._plain)]

    def score(self, effect: Effect, shapes: Array, columns: Mapping[int, Array]) -> tuple[Scored, Scored]:
        """`shapes`, (s, k), of an effect of white `columns`, (s, c, R_j) by joint, with and without discrepancy."""
        joints = self._at.linear.joints
        crossed = {joint: joints[joint].against(own) for joint, own in columns.items()}
        shares = self._shares(columns)
        return tuple(  # type: ignore[return-value]
            self._under(effect, shapes, crossed, shares, *setting) for setting in self._settings
        )

    def _shares(self, columns: Mapping[int, Array]) -> Array:
        """Rms of each column over that of the measured torque, at the joint where that is largest, (s, c)."""
        found = []
        for joint, own in columns.items():
            measured = self._rows.measured_rms(joint, self._at.dependence[joint])
            if measured > 0.0 and own.shape[-1]:
                found.append(np.sqrt(np.mean(own**2, axis=-1)) / measured)
        return np.max(found, axis=0) if found else np.zeros(next(iter(columns.values())).shape[:2])

    def _under(
        self,
        effect: Effect,
        shapes: Array,
        crossed: Mapping[int, tuple[Array, Array]],
        shares: Array,
        scales: Sequence[Scales],
        posterior: Posterior,
    ) -> Scored:
        count, width = shares.shape
        joints, size = self._at.linear.joints, self._at.linear.size
        inner, right = np.zeros((count * width, size)), np.zeros(count * width)
        mutual = np.zeros((count, width, width))
        for joint, own in crossed.items():
            seen, fellows = joints[joint].reduced(scales[joint], *own)
            inner[:, joints[joint].index] += seen[:, 1:]
            right += seen[:, 0]
            mutual += fellows
        left = (right - inner @ posterior.mean).reshape(count, width)
        taken = posterior.solve(inner.T).reshape(size, count, width)
        outside = mutual - np.einsum("scp,psd->scd", inner.reshape(count, width, size), taken)
        return _factors(effect, shapes, left, outside, mutual, shares)


def _factors(effect: Effect, shapes: Array, left: Array, outside: Array, mutual: Array, shares: Array) -> Scored:
    """Log Bayes factors from u and B of every shape."""
    own, whole = np.einsum("scc->sc", outside), np.einsum("scc->sc", mutual)
    visible = ((own > INVISIBLE * whole) & (shares > 0.0)).any(axis=1)
    sizes = SIZES[:, None, None] / np.where(shares > 0.0, shares, 1.0)
    gram = np.eye(left.shape[1]) + sizes[..., :, None] * outside * sizes[..., None, :]
    scaled = sizes * left
    solved = np.linalg.solve(gram, scaled[..., None])[..., 0]
    factors = 0.5 * np.sum(scaled * solved, axis=-1) - 0.5 * np.linalg.slogdet(gram)[1]
    best, every = factors.argmax(axis=0), np.arange(len(left))
    coefficients = (sizes * solved)[best, every]
    one_sided = np.array([each.positive for each in effect.coefficients])
    largest = np.array([each.largest for each in effect.coefficients])
    possible = visible & ~((one_sided & (coefficients < 0.0)) | (np.abs(coefficients) > largest)).any(axis=1)
    found = logsumexp(factors, axis=0) - np.log(len(SIZES)) + np.log(2.0) * one_sided.sum()
    return Scored(effect, shapes, np.where(possible, found, -np.inf), coefficients, sizes[best, every])


def unnamed_log_odds(at: Hypothesis) -> float:
    """Log Bayes factor of torque without a name, against none."""
    return at.log_evidence - replace(at, scales=_without_discrepancy(at)).log_evidence


def _without_discrepancy(at: Hypothesis) -> tuple[Scales, ...]:
    """Scales of a covariance without discrepancy: its noise is all that the model leaves."""
    found = []
    for own, scales in zip(at.linear.joints, at.scales, strict=True):
        direction = np.concatenate([[1.0], -at.posterior.mean[own.index]])
        unit = scales.without_discrepancy(1.0)
        energy = float(direction @ own.weighted(unit).products @ direction)
        noise = np.sqrt(max(energy, np.finfo(float).tiny) / max(float(own.counts.sum()), 1.0))
        found.append(scales.without_discrepancy(float(noise)))
    return tuple(found)
