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

# Singular values of the column-scaled nominal columns below this share of the largest are no direction.
RANK_TOLERANCE = 1e-10
# Share of a candidate's energy outside the nominal columns below which no data of this kind can show it.
INVISIBLE = 1e-7


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Whitened columns of one joint's rows."""

    index: NDArray[np.intp]  # (k,), places among all parameters
    rows: Array  # (k, R), columns, time last


@dataclass(frozen=True, eq=False)
class Projection:
    """A linear model fitted to whitened rows."""

    spread: Array  # (p, r), S with S Sᵀ = (WᵀW)⁺: the parameters' covariance
    basis: tuple[Array, ...]  # tuple of (r, R_j), Qᵀ, joint by joint
    residual: tuple[Array, ...]  # tuple of (R_j,), what the model leaves
    step: Array  # (p,), the fitted parameters
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
    """What is needed of a candidate's columns, for g shapes of c columns each."""

    target: Array  # (g, c), Xᵀ r
    gram: Array  # (g, c, c), Xᵀ X after projection
    shares: Array  # (g, c), share of each column's energy that lies outside the nominal columns
    inner: Array  # (g, c, r), Xᵀ Q


def project(
    columns: Sequence[JointColumns], target: Sequence[Array], size: int, prior: tuple[Array, Array] | None = None
) -> Projection:
    """Fit a linear model to whitened rows.

    `target`: sequence of (R_j,), what is fitted, one a joint.
    `prior`: tuple of (s, p) and (s,), rows of what is known beforehand, of unit variance, and their right-hand side.
    """
    known_rows, known_values = (np.zeros((0, size)), np.zeros(0)) if prior is None else prior
    spread = _spread(columns, known_rows)
    basis = tuple(spread[own.index].T @ own.rows for own in columns)
    of_prior = known_rows @ spread
    inner = np.sum([q @ y for q, y in zip(basis, target, strict=True)], axis=0) + known_values @ of_prior
    residual = tuple(y - inner @ q for q, y in zip(basis, target, strict=True))
    left = known_values - of_prior @ inner
    return Projection(spread, basis, residual, spread @ inner, float(left @ left))


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
    """Moments of a candidate's whitened columns, (g, c, R_j) by joint, beside a fitted model."""
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
