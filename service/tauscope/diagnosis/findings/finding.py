"""One finding beside all others: how much it explains, how sure it is, and what the model without it leaves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.held_out_change import HeldOutChange, sum_stretches
from tauscope.diagnosis.model.residual import raw_squares
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.found import Rival
from tauscope.effects import Effect
from tauscope.recording.recording import Array

# Log odds within which data do not tell two effects apart: a small error of the columns decides between them.
EQUIVALENT = 5.0
# Part of an effect's energy or log odds that counts as nothing between two laws: no formula is exactly that of an arm,
# but errs by a fifth of its amplitude (one standard deviation).
FORMULA_ERROR = 0.2**2


@dataclass(frozen=True, eq=False)
class FitSizes:
    """Rms of the torque residual at the recorded rate, no filter."""

    train: Array  # (n,), on the recordings that the model was made from [Nm or N]
    held_out: Array | None  # (n,), on recordings that were not used
    stretches: Array | None = None  # (n, S), squared errors there, summed over stretches of motion [Nm² or N²]

    @staticmethod
    def of(model: ExtendedModel, rows: Observations, unseen: Observations | None) -> "FitSizes":
        """Residuals of a model on training and held-out recordings."""
        squares, samples = raw_squares(model, rows)
        train = np.sqrt(squares.sum(axis=1) / np.maximum(samples, 1.0))
        if unseen is None:
            return FitSizes(train, None)
        squares, samples = raw_squares(model, unseen)
        return FitSizes(train, np.sqrt(squares.sum(axis=1) / np.maximum(samples, 1.0)), sum_stretches(squares))


@dataclass(frozen=True, eq=False)
class Finding:
    """Effects of one kind at one place: one term, or several orders of a periodic torque."""

    terms: tuple[Term, ...]
    # tuple of (k, k), of each term's coefficients and shapes, in the arm's own torque (`model.torque_scale`)
    covariances: tuple[Array, ...]
    gain: float  # energy of the residual that they explain beside all other findings [noise variances]
    probability: float
    before: FitSizes
    after: FitSizes
    alternatives: tuple[Rival, ...] = ()  # effects that these data cannot tell from it
    confirmed: bool | None = None  # by motion that was not used; None where there was none
    in_model: bool = True
    formula: Effect | None = None  # the law whose error may be all that this one explains (`formula_error`)

    @property
    def is_own(self) -> NDArray[np.bool_]:
        """Whether their formula holds at a joint, (n,)."""
        count = len(self.after.train)
        return np.isin(np.arange(count), self.terms[0].effect.find_own_joints(count))

    @property
    def relative_energy(self) -> Array:
        """Squares that they take off the residuals of these joints, (n,), in what is left of training and held-out."""
        pairs = [(self.before.train, self.after.train), (self.before.held_out, self.after.held_out)]
        taken = [_relative_squares(b, a) - 1.0 for b, a in pairs if b is not None and a is not None]
        return np.where(self.is_own, np.maximum(np.sum(taken, axis=0), 0.0), 0.0)

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.terms[0].place

    @property
    def held_out_change(self) -> HeldOutChange | None:
        """Change on motion that was not used; None where there was none."""
        if self.before.stretches is None or self.after.stretches is None:
            return None
        return HeldOutChange.between(self.before.stretches, self.after.stretches)


def _relative_squares(before: Array, after: Array) -> Array:
    return np.square(before / np.maximum(after, 1e-9 * before + np.finfo(float).tiny))


def in_order(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Findings, most explained energy first; what every arm has comes after what only this one has."""
    return tuple(sorted(found, key=lambda each: (each.terms[0].effect.is_expected, -each.gain)))


def equivalent(log_odds: float, rivals: Sequence[Rival]) -> tuple[Rival, ...]:
    """Rivals that the data cannot tell from an effect."""
    margin = EQUIVALENT + FORMULA_ERROR * abs(log_odds)
    return tuple(each for each in rivals if each.log_odds > log_odds - margin)
