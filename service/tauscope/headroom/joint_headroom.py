"""What a black box predicts of one joint's held-out residual, and whether that is more than chance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import nnls

from tauscope.headroom.learners import LEARNERS, Learner
from tauscope.headroom.motion_rows import Inputs, MotionRows, joint_inputs
from tauscope.recording.recording import Array

FOLDS = 5  # parts of the training motion, each of which is predicted from the others
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
        """Learn `target`, (R,) [Nm or N], from all training rows, and predict others, (J,)."""
        total = np.zeros(len(judged.columns))
        for each in self.members:
            total += each.weight * each.learner.predict(inputs, target, judged)[each.size]
        return total


def fold_numbers(motions: Sequence[MotionRows]) -> list[Folds]:
    """Folds of every row, (R,), by recording and part of the motion: no two hold rows of the same repeated motion."""
    recordings = sorted({each.recording for each in motions})
    splits = [np.concatenate([np.floor(each.progress * FOLDS).astype(np.intp) for each in motions])]
    if len(recordings) > 1:
        places = [np.full(len(each.time), recordings.index(each.recording) % FOLDS) for each in motions]
        splits.append(np.concatenate(places))
    return splits


def choose_black_box(inputs: Inputs, target: Array, splits: Sequence[Folds], learners: Sequence[Learner]) -> Choice:
    """Sizes and weights of learners of least error on unseen folds of the best split; `target`: (R,) [Nm or N]."""
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


MOST_ROWS = 6000  # training rows of one joint that a black box learns from: evenly thinned beyond, to bound its time
FEWEST_ROWS = 100  # training rows below which nothing is learned: five leaves of a tree
BLOCK_S = 1.0  # shortest block of held-out motion whose gains count as independent [s]

# Blocks of all held-out motion: longer ones where there is more of it, so that slow errors stay within one.
MOST_BLOCKS = 20
STANDARD_ERRORS = 2.0  # standard errors that a gain exceeds chance by, of normal blocks in any number


@dataclass(frozen=True)
class JointHeadroom:
    """Rms of a joint's held-out residual [Nm or N], and what the black box predicts of it; NaN without a black box.

    `share`, `share_std`: part of the explained model's residual energy that the black box predicts, and its standard
        error over blocks; negative where it predicts worse.
    """

    plain: float
    explained: float
    black_box: float
    share: float
    share_std: float
    blocks: int

    @property
    def is_significant(self) -> bool:
        """Whether the black box predicts more than by chance: Student's t of so many blocks, at the level of 2 σ."""
        if self.blocks < 2:
            return False
        return bool(self.share > stats.t.isf(stats.norm.sf(STANDARD_ERRORS), self.blocks - 1) * self.share_std)


def joint_headroom(training: Sequence[MotionRows], held_out: Sequence[MotionRows], joint: int) -> JointHeadroom:
    """Train black boxes from the model with all findings, and judge the chosen one once on held-out motion."""
    known, asked = _rows(training, joint), _rows(held_out, joint)
    plain, explained = (_residual(held_out, model, joint) for model in ("plain", "explained"))
    left = np.full_like(explained, np.nan)
    if len(known) >= FEWEST_ROWS and len(asked):
        thinned = known[np.linspace(0, len(known) - 1, min(len(known), MOST_ROWS)).round().astype(np.intp)]
        inputs, splits = _inputs(training, joint).at(thinned), [folds[thinned] for folds in fold_numbers(training)]
        target = _residual(training, "explained", joint, thinned)
        choice = choose_black_box(inputs, target, splits, LEARNERS)
        left = explained - choice.predict(inputs, target, _inputs(held_out, joint).at(asked))
    return compare_residuals(plain, explained, left, _blocks(held_out)[asked])


def compare_residuals(plain: Array, explained: Array, left: Array, blocks: NDArray[np.intp]) -> JointHeadroom:
    """Rms of `plain`, `explained`, `left`, (R,), and how much less is left than explained, by `blocks`, (R,)."""
    energy = max(float(explained @ explained), np.finfo(float).tiny)
    _, place = np.unique(blocks, return_inverse=True)
    gains = np.bincount(place, explained**2 - left**2) if len(place) else np.zeros(0)
    spread = float(np.sqrt(len(gains)) * gains.std(ddof=1)) if len(gains) > 1 else np.inf
    return JointHeadroom(
        _rms(plain), _rms(explained), _rms(left), float(gains.sum()) / energy, spread / energy, len(gains)
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _rows(motions: Sequence[MotionRows], joint: int) -> NDArray[np.intp]:
    """Places of the rows that were measured."""
    return np.flatnonzero(np.concatenate([each.used[joint] for each in motions]))


def _residual(motions: Sequence[MotionRows], model: str, joint: int, rows: NDArray[np.intp] | None = None) -> Array:
    """What a model leaves of the measured torque, in all rows that were measured or in some."""
    left = np.concatenate([each.torque[joint] - getattr(each, model)[joint] for each in motions])
    return left[_rows(motions, joint) if rows is None else rows]


def _inputs(motions: Sequence[MotionRows], joint: int) -> Inputs:
    """Columns of all pieces."""
    parts = [joint_inputs(each, joint) for each in motions]
    return Inputs(np.concatenate([each.columns for each in parts]), parts[0].own)


def _blocks(motions: Sequence[MotionRows]) -> NDArray[np.intp]:
    """Number of every row's block, (R,)."""
    lengths = {}
    for each in motions:
        lengths[each.recording] = max(lengths.get(each.recording, 0.0), float(each.time[-1]))
    block_s = max(BLOCK_S, sum(lengths.values()) / MOST_BLOCKS)
    most = int(max(lengths.values()) / block_s) + 1
    recordings = sorted(lengths)
    return np.concatenate(
        [recordings.index(each.recording) * most + (each.time / block_s).astype(np.intp) for each in motions]
    )
