"""Whether the parameters hold from one recording to the next: the detector of what perfect residuals hide.

A left-out effect that the nominal parameters imitate in one motion makes them move when the motion changes (Chow 1960,
Hausman 1978). With r the residual of the common fit, each group of rows may refit all parameters; under the hypothesis
that they are the same the decrease Σ ‖P_g r_g‖² is χ² with Σ rank_g - rank degrees of freedom.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.projection import JointColumns
from tauscope.recording.recording import Array

LEVEL = 1e-4  # chance at which parameters are said to have moved
MOST_SHOWN = 8
SHOWN_FROM = 4.0  # standard errors from which a parameter is named
KNOWN = 1e-8  # singular values of a group's column-scaled factor, relative to the largest, that count as information


@dataclass(frozen=True)
class Move:
    """A parameter that is not the same in two groups of rows."""

    parameter: int
    between: tuple[str, str]
    shift_in_std: float


@dataclass(frozen=True)
class Constancy:
    """What the groups say."""

    p_value: float
    moves: tuple[Move, ...]

    @property
    def holds(self) -> bool:
        """Whether the parameters may be the same."""
        return self.p_value >= LEVEL


@dataclass(frozen=True, eq=False)
class _Group:
    """A group's rows reduced to a triangle."""

    name: str
    triangle: Array
    target: Array
    gain: float
    rank: int
    estimate: Array
    variance: Array


def constancy(fitter: Fitter, fit: Fit, held_out: Fitter | None, inflation: float) -> Constancy:
    """Compare the parameters of all recordings, or of the halves of a single one; held-out ones are one more."""
    inflation = max(inflation, fit.inflation())
    size = fit.model.size
    columns = fitter.columns(fit.model)
    groups = _groups(fitter, columns, list(fit.projection.residual), size)
    if held_out is not None:
        rows = held_out.columns(fit.model)
        groups += _groups(held_out, rows, held_out.white_residual(fit.model), size, whole=True)
    if len(groups) < 2:
        return Constancy(1.0, ())
    stacked = np.concatenate([group.triangle for group in groups])
    target = np.concatenate([group.target for group in groups])
    _, rank, pooled = _solved(stacked, target)
    statistic = max(sum(group.gain for group in groups) - pooled, 0.0)
    freedom = max(sum(group.rank for group in groups) - rank, 1)
    p_value = float(stats.chi2.sf(statistic / inflation, freedom))
    return Constancy(p_value, _moves(groups, inflation) if p_value < LEVEL else ())


def _groups(
    fitter: Fitter, columns: Sequence[JointColumns], residual: Sequence[Array], size: int, *, whole: bool = False
) -> list[_Group]:
    """One group a recording; early and late of a single one."""
    observations = fitter.observations
    labels = [observations.row_labels(joint) for joint in range(len(columns))]
    name = ", ".join(observations.names)
    if whole:
        masks = {name: [np.ones(len(row), dtype=bool) for row in residual]}
    elif len(observations.names) > 1:
        masks = {name: [recording == place for recording, _ in labels] for place, name in enumerate(observations.names)}
    else:
        _, instants_of_first = labels[0]
        middle = float(np.median(instants_of_first))
        masks = {
            f"{name} (first half)": [instants < middle for _, instants in labels],
            f"{name} (second half)": [instants >= middle for _, instants in labels],
        }
    return [_group(name, columns, residual, own, size) for name, own in masks.items() if all(m.any() for m in own)]


def _group(
    name: str, columns: Sequence[JointColumns], residual: Sequence[Array], masks: Sequence[NDArray[np.bool_]], size: int
) -> _Group:
    blocks, targets = [], []
    for own, left, mask in zip(columns, residual, masks, strict=True):
        q, triangle = np.linalg.qr(own.rows[:, mask].T)
        block = np.zeros((len(triangle), size))
        block[:, own.index] = triangle
        blocks.append(block)
        targets.append(q.T @ left[mask])
    triangle, target = np.concatenate(blocks), np.concatenate(targets)
    spread, rank, gain = _solved(triangle, target)
    return _Group(
        name, triangle, target, gain, rank, spread @ (spread.T @ (triangle.T @ target)), np.sum(spread**2, axis=1)
    )


def _solved(matrix: Array, target: Array) -> tuple[Array, int, float]:
    """Spread of the least-squares solution, rank, and the energy that it explains."""
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    left, singular, right = np.linalg.svd(matrix / scale, full_matrices=False)
    known = singular > KNOWN * singular[0]
    spread = right[known].T / singular[known] / scale[:, None]
    return spread, int(known.sum()), float(np.sum((left[:, known].T @ target) ** 2))


def _moves(groups: Sequence[_Group], inflation: float) -> tuple[Move, ...]:
    """The clearest shifts between any two groups."""
    found = []
    for place, first in enumerate(groups):
        for second in groups[place + 1 :]:
            error = np.sqrt((first.variance + second.variance) * inflation)
            shifts = (second.estimate - first.estimate) / np.where(error > 0.0, error, np.inf)
            found += [Move(k, (first.name, second.name), float(shift)) for k, shift in enumerate(shifts)]
    found = [move for move in found if abs(move.shift_in_std) > SHOWN_FROM]
    return tuple(sorted(found, key=lambda move: -abs(move.shift_in_std))[:MOST_SHOWN])
