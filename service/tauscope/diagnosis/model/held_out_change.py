"""How much better one model predicts held-out motion than another, joint by joint.

Errors of neighbouring samples are alike, so a standard error comes from sums over stretches of motion. With a_s and b_s
the squared errors after and before, summed over stretch s of S, ρ = Σ a_s / Σ b_s, and ρ_s the same without stretch s,

    change of the rms = √ρ - 1,        σ(ρ)² = (S - 1)/S Σ (ρ_s - mean ρ_s)²,

the jackknife: a change that a single stretch makes is one standard error of itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tauscope.recording.recording import Array

STRETCHES = 24  # stretches of motion: their spread, and so a standard error, is known to a seventh
SHORTEST = 8  # samples of a stretch, at least: errors of neighbouring samples are alike
LOST = 2.0  # standard errors from which a joint loses…
SHOWN = 0.005  # …by a part of its rms that three digits show: a smaller loss changes no number that anybody reads
SPILLED = 1.0 / 3.0  # part of the gain of all joints that others may lose


def stretches(count: int) -> list[slice]:
    """Rows of each stretch among `count` rows in the order of time."""
    edges = np.linspace(0, count, max(min(STRETCHES, count // SHORTEST), 1) + 1).astype(int)
    return [slice(start, stop) for start, stop in pairwise(edges)]


def sum_stretches(squares: Array) -> Array:
    """Sums over stretches of motion, (n, S). `squares`: (n, N), squared errors in the order of time."""
    return np.stack([squares[:, rows].sum(axis=1) for rows in stretches(squares.shape[1])], axis=1)


@dataclass(frozen=True, eq=False)
class HeldOutChange:
    """Change of what a model leaves of held-out motion."""

    relative: Array  # (n,), of every joint's rms; below zero is better
    error: Array  # (n,), its standard error; infinite where the motion is too short to tell it
    # (n,), magnitude of the change in standard errors if all that the models differ in is there
    expected: Array | None = None

    @staticmethod
    def between(before: Array, after: Array, difference: Array | None = None) -> "HeldOutChange":
        """From squared errors of two models and what they differ in, (n, S) each, summed over the same stretches."""
        count, whole = before.shape[1], before.sum(axis=1)
        ratio = _divide(after.sum(axis=1), whole)
        if count == 1:
            return HeldOutChange(np.sqrt(ratio) - 1.0, np.full(len(before), np.inf), np.zeros(len(before)))
        without = _divide(after.sum(axis=1)[:, None] - after, whole[:, None] - before)
        slope = 2.0 * np.sqrt(np.maximum(ratio, np.finfo(float).tiny))
        error, expected = np.sqrt(count - 1.0) * without.std(axis=1), None
        if difference is not None:
            size = difference.sum(axis=1) / np.where(whole > 0.0, whole, 1.0)
            expected = np.divide(size, error, out=np.zeros_like(size), where=error > 0.0)
        return HeldOutChange(np.sqrt(ratio) - 1.0, error / slope, expected)

    @property
    def standard(self) -> Array:
        """Change in standard errors, (n,); zero where nothing changed."""
        return np.divide(self.relative, self.error, out=np.zeros_like(self.relative), where=self.error > 0.0)

    def tells(self, joints: Sequence[int]) -> bool:
        """Whether the motion is long enough to say anything of some joints."""
        return bool(np.isfinite(self.error[list(joints)]).any())

    @property
    def losing(self) -> list[int]:
        """Joints that are predicted worse."""
        return np.flatnonzero((self.standard > LOST) & (self.relative > SHOWN)).tolist()

    @property
    def harm(self) -> float:
        """What joints lose beyond a small part of what all others gain [log rms].

        All joints share the links. What is believed of these moves with an effect, and other joints with it.
        """
        gain = np.log1p(self.relative)
        lost = float(gain[self.losing].sum())
        return lost + SPILLED * float(np.minimum(gain, 0.0).sum()) if lost > 0.0 else 0.0

    def log_odds(self, joints: Sequence[int] | None = None) -> float:
        """Log odds that held-out motion adds to the second model, 2 z min(|z|, z_e) of each joint.

        Where a torque f is there, leaving it out costs Σ f² ± 2σ √(κ Σ f²) in white noise σ whose rows count as 1/κ:
        the change expected is z_e = √(Σ f²/κ) / 2σ, and a change z has the likelihood ratio exp(2 z z_e). So the noise
        need not be known, and luck that exceeds what the torque can do says no more than the torque would.
        """
        size = np.abs(self.standard) if self.expected is None else np.minimum(np.abs(self.standard), self.expected)
        own = -2.0 * self.standard * size
        return float(np.sum(own if joints is None else own[list(joints)]))


def _divide(after: Array, before: Array) -> Array:
    """Ratios of errors; one where there were none."""
    return np.divide(after, before, out=np.ones_like(after), where=before > 0.0)
