"""How much better one model predicts held-out motion than another, joint by joint.

Errors of neighbouring samples are alike, so a standard error comes from sums over stretches of motion. With a_s and b_s
the squared errors after and before, summed over stretch s of S, and ρ = Σ a_s / Σ b_s,

    change of the rms = √ρ - 1,        σ(ρ) = √S std(a_s - ρ b_s) / Σ b_s.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.recording.recording import Array

STRETCHES = 24
"""Stretches of motion: their spread, and so a standard error, is known to a seventh."""

SHORTEST = 8
"""Samples of a stretch, at least: errors of neighbouring samples are alike."""

LOST = 2.0
"""Standard errors from which another joint loses…"""

SHOWN = 0.005
"""…by a part of its rms that three digits show: a smaller loss changes no number that anybody reads."""


def sum_stretches(squares: Array) -> Array:
    """Sums over stretches of motion, (n, S).

    Parameters
    ----------
    squares : (n, N) float64
        squared errors in the order of time
    """
    count = max(min(STRETCHES, squares.shape[1] // SHORTEST), 1)
    return np.stack([part.sum(axis=1) for part in np.array_split(squares, count, axis=1)], axis=1)


@dataclass(frozen=True, eq=False)
class HeldOutChange:
    """Change of what a model leaves of held-out motion.

    relative : (n,) float64
        of every joint's rms; below zero is better
    error : (n,) float64
        its standard error; infinite where the motion is too short to tell it
    """

    relative: Array
    error: Array

    @staticmethod
    def between(before: Array, after: Array) -> "HeldOutChange":
        """From squared errors of two models.

        Parameters
        ----------
        before, after : (n, S) float64
            summed over the same stretches
        """
        stretches = before.shape[1]
        whole = before.sum(axis=1)
        whole = np.where(whole > 0.0, whole, 1.0)
        ratio = np.where(before.any(axis=1), after.sum(axis=1) / whole, 1.0)
        if stretches == 1:
            return HeldOutChange(np.sqrt(ratio) - 1.0, np.full(len(before), np.inf))
        spread = (after - ratio[:, None] * before).std(axis=1, ddof=1)
        slope = 2.0 * np.sqrt(np.maximum(ratio, np.finfo(float).tiny))
        return HeldOutChange(np.sqrt(ratio) - 1.0, np.sqrt(stretches) * spread / whole / slope)

    @property
    def standard(self) -> Array:
        """Change in standard errors, (n,); zero where nothing changed."""
        return np.divide(self.relative, self.error, out=np.zeros_like(self.relative), where=self.error > 0.0)

    @property
    def losing(self) -> list[int]:
        """Joints that are predicted worse."""
        return np.flatnonzero((self.standard > LOST) & (self.relative > SHOWN)).tolist()
