"""Candidates and residual seen beside the nominal columns: the Frisch–Waugh–Lovell theorem.

With Q an orthonormal basis of the nominal model's whitened columns W, r = (I - Q Qᵀ) y the residual and x a candidate's
column, adding x to the model takes

    T = (xᵀ r)² / (‖x‖² - ‖Qᵀ x‖²)

off the residual's energy, with the nominal parameters fitted anew: no candidate is ever compared with the raw residual.
A candidate that touches few joints needs those joints' rows only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array

RANK_TOLERANCE = 1e-10
"""Singular values of the column-scaled nominal columns below this share of the largest are no direction."""

SINGULAR = 1e-9
"""Eigenvalues of a candidate's normalised Gram matrix below this are no direction."""

INVISIBLE = 1e-7
"""Share of a candidate's energy outside the nominal columns below which no data of this kind can show it."""


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Whitened columns of one joint's rows.

    index : (k,) int
        places among all parameters
    rows : (k, R) float64
        columns, time last
    """

    index: NDArray[np.intp]
    rows: Array


@dataclass(frozen=True, eq=False)
class Projection:
    """A linear model fitted to whitened rows.

    spread : (p, r) float64
        S with S Sᵀ = (WᵀW)⁺: the parameters' covariance
    basis : tuple of (r, R_j) float64
        Qᵀ, joint by joint
    residual : tuple of (R_j,) float64
        what the model leaves
    step : (p,) float64
        the fitted parameters
    """

    spread: Array
    basis: tuple[Array, ...]
    residual: tuple[Array, ...]
    step: Array
    prior_energy: float = 0.0
    independent: float | None = None

    @property
    def energy(self) -> float:
        """Σ r², the prior's included."""
        return float(sum(row @ row for row in self.residual)) + self.prior_energy

    @property
    def freedom(self) -> float:
        """Independent rows less parameters."""
        rows = sum(len(row) for row in self.residual) if self.independent is None else self.independent
        return max(rows - self.spread.shape[1], 1.0)


@dataclass(frozen=True, eq=False)
class Moments:
    """What is needed of a candidate's columns, for g shapes of c columns each.

    target : (g, c) float64
        Xᵀ r
    gram : (g, c, c) float64
        Xᵀ X after projection
    shares : (g, c) float64
        share of each column's energy that lies outside the nominal columns
    inner : (g, c, r) float64
        Xᵀ Q
    """

    target: Array
    gram: Array
    shares: Array
    inner: Array


def project(
    columns: Sequence[JointColumns], target: Sequence[Array], size: int, prior: tuple[Array, Array] | None = None
) -> Projection:
    """Fit a linear model to whitened rows.

    Parameters
    ----------
    target : sequence of (R_j,) float64
        what is fitted, one a joint
    prior : tuple of (s, p) float64 and (s,) float64, optional
        rows of what is known beforehand, of unit variance, and their right-hand side
    """
    known_rows, known_values = (np.zeros((0, size)), np.zeros(0)) if prior is None else prior
    spread = _spread(columns, known_rows)
    basis = tuple(spread[own.index].T @ own.rows for own in columns)
    of_prior = known_rows @ spread
    inner = np.sum([q @ y for q, y in zip(basis, target, strict=True)], axis=0) + known_values @ of_prior
    residual = tuple(y - inner @ q for q, y in zip(basis, target, strict=True))
    left = known_values - of_prior @ inner
    return Projection(spread, basis, residual, spread @ inner, float(left @ left))


def fitted_parameters(columns: Sequence[JointColumns], target: Sequence[Array], size: int) -> Array:
    """The fitted parameters alone, (p,): with no basis and no residual, a fraction of what `project` costs.

    Parameters
    ----------
    target : sequence of (R_j,) float64
        what is fitted, one a joint
    """
    spread = _spread(columns, np.zeros((0, size)))
    inner = np.zeros(size)
    for own, y in zip(columns, target, strict=True):
        inner[own.index] += own.rows @ y
    return np.asarray(spread @ (spread.T @ inner))


def _spread(columns: Sequence[JointColumns], known_rows: Array) -> Array:
    """S with S Sᵀ = (WᵀW)⁺, (p, r), of columns and of rows (s, p) of what is known beforehand."""
    blocks = [known_rows]
    for own in columns:
        triangle = np.linalg.qr(own.rows.T, mode="r")
        block = np.zeros((len(triangle), known_rows.shape[1]))
        block[:, own.index] = triangle
        blocks.append(block)
    stacked = np.concatenate(blocks)
    scale = np.linalg.norm(stacked, axis=0)
    scale[scale == 0.0] = 1.0
    _, singular, right = np.linalg.svd(stacked / scale, full_matrices=False)
    known = singular > RANK_TOLERANCE * max(singular[0], np.finfo(float).tiny)
    return np.asarray(right[known].T / singular[known] / scale[:, None])


def moments(projection: Projection, columns: Mapping[int, Array]) -> Moments:
    """Moments of a candidate's columns beside a fitted model.

    Parameters
    ----------
    columns : mapping of int to (g, c, R_j) float64
        whitened columns at every joint that the candidate touches
    """
    target, inner, gram = 0.0, 0.0, 0.0
    for joint, rows in columns.items():
        target = target + rows @ projection.residual[joint]
        inner = inner + rows @ projection.basis[joint].T
        gram = gram + rows @ rows.swapaxes(1, 2)
    raw, inner = np.asarray(gram), np.asarray(inner)
    projected = raw - inner @ inner.swapaxes(1, 2)
    energy = np.einsum("gcc->gc", raw)
    shares = np.einsum("gcc->gc", projected) / np.where(energy > 0.0, energy, 1.0)
    return Moments(np.asarray(target), projected, np.clip(shares, 0.0, 1.0), inner)


def statistics(found: Moments, positive: Sequence[bool]) -> tuple[Array, Array]:
    """What each shape takes off the residual's energy, and the coefficients with which it does.

    Returns
    -------
    tuple of (g,) float64 and (g, c) float64
        T and the coefficients
    """
    gains = np.zeros(len(found.target))
    coefficients = np.zeros_like(found.target)
    present = found.shares > INVISIBLE
    whole = np.flatnonzero(present.all(axis=1))
    solved = _all_solved(found.target[whole], found.gram[whole])
    right = ~((solved < 0.0) & np.asarray(positive)).any(axis=1)
    coefficients[whole[right]] = solved[right]
    gains[whole[right]] = np.sum(solved[right] * found.target[whole[right]], axis=1)
    for place in np.setdiff1d(np.flatnonzero(present.any(axis=1)), whole[right]):
        gains[place], coefficients[place] = _solved(found.target[place], found.gram[place], present[place], positive)
    return gains, coefficients


def _all_solved(target: Array, gram: Array) -> Array:
    """Coefficients of many shapes of which every column counts, (g, c)."""
    scale = np.sqrt(np.einsum("gcc->gc", gram))
    values, vectors = np.linalg.eigh(gram / (scale[:, :, None] * scale[:, None, :]))
    inverse = np.where(values > SINGULAR, 1.0 / np.where(values > SINGULAR, values, 1.0), 0.0)
    inner = np.einsum("gcv,gc->gv", vectors, target / scale)
    return np.einsum("gcv,gv->gc", vectors, inverse * inner) / scale


def _solved(target: Array, gram: Array, present: NDArray[np.bool_], positive: Sequence[bool]) -> tuple[float, Array]:
    """Gain and coefficients of one shape; columns of the wrong sign are taken out one after another."""
    present = present.copy()
    solution = np.zeros(len(target))
    while present.any():
        keep = [int(place) for place in np.flatnonzero(present)]
        part = gram[np.ix_(keep, keep)]
        scale = np.sqrt(np.diag(part))
        values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
        known = values > SINGULAR
        half = vectors[:, known] / np.sqrt(values[known])
        solved = (half @ (half.T @ (target[keep] / scale))) / scale
        wrong = [k for k, value in zip(keep, solved, strict=True) if positive[k] and value < 0.0]
        if not wrong:
            solution[keep] = solved
            return float(target[keep] @ solved), solution
        present[wrong] = False
    return 0.0, solution
