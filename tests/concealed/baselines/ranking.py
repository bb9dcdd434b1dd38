"""Three ways to name an effect that others would try first, on the same residual and the same columns.

correlation
    multiple correlation of the residual with an effect's columns, at their best shape; nothing is projected off
sparse
    sequentially thresholded least squares on the residual (SINDy: Brunton, Proctor, Kutz, PNAS 113(15), 2016), every
    effect at the shape that correlates best; an effect's size is its torque's rms over the residual's where it acts
bic
    every effect alone beside the nominal model, all fitted together; by how much the Bayesian information criterion
    (Schwarz 1978) falls, rows taken for independent
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from concealed.baselines.columns import Columns, Ground
from tauscope.diagnosis.fitting.projection import moments

Array = NDArray[np.float64]
Ranking = list[tuple[str, float]]
"""Places from the likeliest on, each with its score."""

KEPT = 6
"""Places of a ranking that are kept."""

THRESHOLDS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7)
"""Sizes below which sparse regression drops an effect, one ranking each."""

RIDGE = 1e-6
ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Best:
    """An effect at the shape that correlates best.

    score : float
        multiple correlation
    columns : (c, R) float64
        over the rows of all joints, zero where it touches none
    """

    score: float
    columns: Array


def rankings(ground: Ground) -> dict[str, Any]:
    """All baselines' rankings; those of sparse regression by threshold."""
    best: dict[str, Best] = {}
    criterion: dict[str, float] = {}
    for each in ground.columns():
        found = _best(each, ground.residual)
        if each.place not in best or found.score > best[each.place].score:
            best[each.place] = found
        criterion[each.place] = max(criterion.get(each.place, -np.inf), _criterion(each, ground))
    residual = np.concatenate(ground.residual)
    return {
        "correlation": _sorted({place: each.score for place, each in best.items()}),
        "bic": _sorted(criterion),
        "sparse": {f"{limit:g}": _sorted(sparse(best, residual, limit)) for limit in THRESHOLDS},
    }


def _sorted(scores: dict[str, float]) -> Ranking:
    return sorted(((place, float(score)) for place, score in scores.items()), key=lambda told: -told[1])[:KEPT]


def _best(columns: Columns, residual: Sequence[Array]) -> Best:
    """The shape whose columns correlate best with the residual at the joints that they touch."""
    touched = list(columns.rows)
    target = np.concatenate([residual[joint] for joint in touched])
    rows = np.concatenate([columns.rows[joint] for joint in touched], axis=2)  # (g, c, R)
    gram = rows @ rows.swapaxes(1, 2)
    inner = rows @ target
    explained = np.einsum("gc,gc->g", inner, (np.linalg.pinv(gram, hermitian=True) @ inner[:, :, None])[:, :, 0])
    place = int(np.argmax(explained))
    whole = [
        columns.rows[joint][place] if joint in columns.rows else np.zeros((rows.shape[1], len(each)))
        for joint, each in enumerate(residual)
    ]
    share = max(float(explained[place]), 0.0) / float(target @ target)
    return Best(float(np.sqrt(min(share, 1.0))), np.concatenate(whole, axis=1))


def _criterion(columns: Columns, ground: Ground) -> float:
    """Fall of N log(RSS) + k log N at the best shape."""
    found = moments(ground.fit.projection, columns.rows)
    solved = (np.linalg.pinv(found.gram, rcond=1e-9, hermitian=True) @ found.target[:, :, None])[:, :, 0]
    gains = np.einsum("gc,gc->g", found.target, solved)
    rows = sum(len(row) for row in ground.residual)
    left = sum(float(row @ row) for row in ground.residual)
    gain = min(float(gains.max()), left * (1.0 - 1e-9))
    return -rows * float(np.log1p(-gain / left)) - (found.target.shape[1] + columns.shapes) * float(np.log(rows))


def sparse(best: dict[str, Best], residual: Array, limit: float) -> dict[str, float]:
    """Sizes of the effects that survive sequential thresholding at `limit`."""
    kept, sizes = list(best), dict[str, float]()
    for _ in range(ROUNDS):
        if not kept:
            return {}
        sizes = dict(zip(kept, _sizes([best[place].columns for place in kept], residual), strict=True))
        left = [place for place in kept if sizes[place] >= limit]
        if left == kept:
            break
        kept = left
    return {place: sizes[place] for place in kept}


def _sizes(columns: Sequence[Array], residual: Array) -> list[float]:
    """Rms of every effect's torque in the common least-squares fit, at the joints that it touches."""
    rows = np.concatenate(columns)
    norms = np.linalg.norm(rows, axis=1)
    rows = rows / np.where(norms > 0.0, norms, 1.0)[:, None]
    gram = rows @ rows.T + RIDGE * np.eye(len(rows))
    fitted = np.linalg.solve(gram, rows @ residual)
    bounds = np.cumsum([0, *(len(each) for each in columns)])
    torques = [fitted[first:last] @ rows[first:last] for first, last in pairwise(bounds)]
    touched = [max(int(np.count_nonzero(torque)), 1) for torque in torques]
    return [float(np.sqrt(torque @ torque / count)) for torque, count in zip(torques, touched, strict=True)]
