"""Black boxes: gradient-boosted trees, and a kernel method; each predicts at all of its sizes at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tauscope.headroom.motion_rows import Inputs
from tauscope.recording.recording import Array

TREES = (10, 20, 40, 80, 160)  # numbers of trees to choose from
LEARNING_RATE = 0.1
FEWEST_IN_LEAF = 20

LANDMARKS = 300  # rows that a kernel compares every other row with (Nyström)
RIDGES = (1e-3, 1e-2, 1e-1, 1.0)  # ridge weights to choose from, a row


CHUNK = 8192  # rows that a kernel predicts at once: bounds memory


class Learner(Protocol):
    """A black box of one kind."""

    def predict(self, inputs: Inputs, target: Array, judged: Inputs) -> Mapping[float, Array]:
        """Learn `target`, (R,), of some rows and predict others, (J,), by size of the black box [Nm or N]."""
        ...


@dataclass(frozen=True)
class BoostedTrees:
    """Trees of so many leaves, each on what those before it leave."""

    leaves: int

    def predict(self, inputs: Inputs, target: Array, judged: Inputs) -> Mapping[float, Array]:
        """By number of trees; `target`: (R,), predictions (J,) [Nm or N]."""
        from sklearn.ensemble import HistGradientBoostingRegressor

        model = HistGradientBoostingRegressor(
            learning_rate=LEARNING_RATE,
            max_iter=TREES[-1],
            max_leaf_nodes=self.leaves,
            min_samples_leaf=FEWEST_IN_LEAF,
            max_features=0.5,  # half of the columns a split: less correlated trees, in half the time
            early_stopping=False,  # pyright: ignore[reportArgumentType] - its documentation says "bool", in words
            random_state=0,
        ).fit(inputs.columns, target)
        staged = enumerate(model.staged_predict(judged.columns), start=1)
        return {count: predicted for count, predicted in staged if count in TREES}


@dataclass(frozen=True)
class KernelRidge:
    """Ridge regression on d standardised columns and a Gaussian kernel, k(x, y) = exp(-‖x - y‖² / (2 w² d))."""

    width: float
    own_joint: bool

    def predict(self, inputs: Inputs, target: Array, judged: Inputs) -> Mapping[float, Array]:
        """By ridge weight; `target`: (R,), predictions (J,) [Nm or N]."""
        from sklearn.kernel_approximation import Nystroem

        count = inputs.own if self.own_joint else inputs.columns.shape[1]
        known, asked = inputs.columns[:, :count], judged.columns[:, :count]
        center, scale = known.mean(axis=0), known.std(axis=0)
        scale[scale <= np.finfo(float).eps * np.abs(center)] = np.inf  # a column that says nothing
        asked = np.clip(asked, known.min(axis=0), known.max(axis=0))  # it extrapolates nothing, as trees do not
        known, asked = (known - center) / scale, (asked - center) / scale
        kernel = Nystroem(
            gamma=0.5 / (self.width**2 * count), n_components=min(LANDMARKS, len(known)), random_state=0
        ).fit(known)
        features = np.hstack([kernel.transform(known), known])
        means, mean = features.mean(axis=0), target.mean()
        features -= means
        powers, directions = np.linalg.eigh(features.T @ features / len(features))
        along = directions.T @ (features.T @ (target - mean)) / len(features)
        weights = directions @ (along[:, None] / (np.maximum(powers, 0.0)[:, None] + RIDGES))
        parts = [asked[first : first + CHUNK] for first in range(0, len(asked), CHUNK)]
        predicted = [(np.hstack([kernel.transform(each), each]) - means) @ weights for each in parts]
        return dict(zip(RIDGES, mean + np.concatenate(predicted).T, strict=True))


# All that are tried at every joint.
LEARNERS: tuple[Learner, ...] = (
    BoostedTrees(8),
    BoostedTrees(32),
    KernelRidge(0.3, own_joint=True),
    KernelRidge(1.0, own_joint=False),
)
