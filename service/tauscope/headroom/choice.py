"""How far each black box is to be believed, by cross-validation within the training motion alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from tauscope.headroom.learners import Learner
from tauscope.headroom.motion_rows import Inputs, MotionRows
from tauscope.recording.recording import Array

FOLDS = 5
"""Parts of the training motion, each of which is predicted from the others."""

Folds = NDArray[np.intp]


@dataclass(frozen=True)
class Member:
    """One black box at its best size, and what its predictions are multiplied by."""

    learner: Learner
    size: float
    weight: float  # 0 where it predicts nothing of motion that it has not learned from


@dataclass(frozen=True)
class Choice:
    """Black boxes whose weighted predictions are added."""

    error: float  # Σ e² of rows that are predicted from other motion, relative to that of the rows themselves
    members: tuple[Member, ...] = ()

    def predict(self, inputs: Inputs, target: Array, judged: Inputs) -> Array:
        """Learn from all training rows, and predict others, (J,).

        `target`: (R,), what is to be predicted of the training rows [Nm or N].
        """
        total = np.zeros(len(judged.columns))
        for each in self.members:
            total += each.weight * each.learner.predict(inputs, target, judged)[each.size]
        return total


def fold_numbers(motions: Sequence[MotionRows]) -> list[Folds]:
    """Folds of every row, (R,): by part of the motion, and by recording where there are several.

    A motion that repeats is cut alike in every repetition: no fold has rows of the same motion as another.
    """
    recordings = sorted({each.recording for each in motions})
    splits = [np.concatenate([np.floor(each.progress * FOLDS).astype(np.intp) for each in motions])]
    if len(recordings) > 1:
        places = [np.full(len(each.time), recordings.index(each.recording) % FOLDS) for each in motions]
        splits.append(np.concatenate(places))
    return splits


def choose_black_box(inputs: Inputs, target: Array, splits: Sequence[Folds], learners: Sequence[Learner]) -> Choice:
    """The learners' sizes and weights of the smallest error on folds that they have not learned from.

    Of several splits, the one by which most is predicted: motion may be told by other recordings, or by its neighbours.

    `target`: (R,), what is to be predicted [Nm or N].
    """
    choices = [_stack(inputs, target, folds, learners) for folds in splits]
    return min(choices, key=lambda each: each.error)


def _stack(inputs: Inputs, target: Array, folds: Folds, learners: Sequence[Learner]) -> Choice:
    """Stacking (Breiman 1996): min ‖y - Σ w_l ŷ_l‖² over w ≥ 0, ŷ_l predicted of every fold from all others."""
    numbers, energy = np.unique(folds), float(target @ target)
    if len(numbers) < 2 or energy == 0.0:
        return Choice(1.0)
    predicted, sizes = [], []
    for learner in learners:
        of_size: dict[float, Array] = {}
        for number in numbers:
            own = folds == number
            for size, rows in learner.predict(inputs.at(~own), target[~own], inputs.at(own)).items():
                of_size.setdefault(size, np.zeros(len(target)))[own] = rows
        best = min(of_size, key=lambda size: float(np.sum((target - of_size[size]) ** 2)))
        sizes.append(best)
        predicted.append(of_size[best])
    weights, left = nnls(np.stack(predicted, axis=1), target)
    members = zip(learners, sizes, weights, strict=True)
    return Choice(float(left**2) / energy, tuple(Member(*each) for each in members if each[-1] > 0.0))
