"""Products of one joint's rows: all that evidence asks of them, whatever the scales of the covariance."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotri

from tauscope.diagnosis.evidence.scales import Scales
from tauscope.effects.computation import LastFew
from tauscope.recording.recording import Array

Index = NDArray[np.intp]
ROUNDING = 1e-12  # added to the diagonal of a correlation matrix: what rounding takes off it
KEPT = 2  # scales whose products are kept: many hypotheses ask for the same


def factor(matrix: Array, scale: Array) -> Array:
    """Lower Cholesky factor, (p, p), of a matrix, (p, p), over its `scale`, (p,), the root of its diagonal."""
    correlation = matrix / np.outer(scale, scale) + ROUNDING * np.eye(len(scale))
    return np.asarray(np.linalg.cholesky(correlation), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Weighted:
    """A joint's rows under scales."""

    products: Array  # (1 + k, 1 + k), Zᵀ C⁻¹ Z of target and columns
    log_determinant: float  # log det C
    whole: Array  # (1 + k + b, 1 + k + b), Zᵀ W Z with W = 1 / σ² D
    half: Array  # (b, 1 + k), K^(-1/2) A Bᵀ W Z of target and columns, K = 1 + A Bᵀ W B A
    root: Array  # (b, b), K^(1/2)


@dataclass(frozen=True, eq=False)
class JointMoments:
    """Rows Z = [target; columns; features] of one joint, in classes of rest, and their products in each class."""

    index: Index  # (k,), places of the columns among all parameters
    rows: Array  # (1 + k + b, R), white rows
    bounds: Index  # (K + 1,), where each class begins
    products: Array  # (K, 1 + k + b, 1 + k + b), Z Zᵀ of each class
    counts: Array  # (K,), independent rows of each class; one that tells less than a whole one counts as a part
    groups: Index  # (b,), group of each feature; -1 for a column error of known size
    _known: LastFew[bytes, Weighted] = field(default_factory=lambda: LastFew(KEPT), init=False)

    @staticmethod
    def of(
        index: Index, target: Array, columns: Array, features: Array, bounds: Index, counts: Array, groups: Index
    ) -> "JointMoments":
        """From rows that are ordered by class."""
        rows = np.vstack([target[None], columns, features])
        products = np.stack([part @ part.T for part in _split(rows, bounds)])
        return JointMoments(index, rows, bounds, products, counts, groups)

    @property
    def visible(self) -> int:
        """Rows of Z before the features: the target and the columns."""
        return 1 + len(self.index)

    def against(self, columns: Array) -> tuple[Array, Array]:
        """Products of `columns`, (s, c, R), with Z, (K, s c, 1 + k + b), and within each of s shapes, (K, s, c, c)."""
        flat = columns.reshape(-1, columns.shape[-1])
        parts = list(zip(_split(flat, self.bounds), _split(self.rows, self.bounds), strict=True))
        mutual = [own.reshape(*columns.shape[:2], -1) for own, _ in parts]
        return np.stack([own @ rows.T for own, rows in parts]), np.stack([m @ m.transpose(0, 2, 1) for m in mutual])

    def extend(self, index: Index, columns: Array) -> "JointMoments":
        """The same with white columns, (c, R), of more parameters, at `index`, (c,), among all."""
        crossed, mutual = self.against(columns[None])
        at, count = self.visible, len(columns)
        order = np.r_[:at, len(self.rows) : len(self.rows) + count, at : len(self.rows)]
        whole = np.concatenate(
            [
                np.concatenate([self.products, crossed.transpose(0, 2, 1)], axis=2),
                np.concatenate([crossed, mutual[:, 0]], axis=2),
            ],
            axis=1,
        )
        return replace(
            self,
            index=np.concatenate([self.index, index]),
            rows=np.vstack([self.rows, columns])[order],
            products=whole[:, order][:, :, order],
        )

    def counting(self, share: float) -> "JointMoments":
        """The same rows, each counting as a share of one."""
        root = np.sqrt(share)
        return replace(self, rows=root * self.rows, products=share * self.products, counts=share * self.counts)

    def without(self, places: Index, values: Array) -> "JointMoments":
        """The same with parameters at `places`, (c,), among all held at `values`, (c,)."""
        held = np.isin(self.index, places)
        value_of = dict(zip(places.tolist(), values.tolist(), strict=True))
        change = np.eye(len(self.rows))
        change[0, 1 : self.visible][held] = [-value_of[place] for place in self.index[held].tolist()]
        change = change[np.concatenate([[True], ~held, np.ones(len(self.rows) - self.visible, dtype=bool)])]
        return replace(
            self, index=self.index[~held], rows=change @ self.rows, products=change @ self.products @ change.T
        )

    def weighted(self, scales: Scales) -> Weighted:
        """Zᵀ C⁻¹ Z by Woodbury's identity: C = σ² D + B A² Bᵀ, D = 1 + r² c² by class, A amplitudes of features B."""
        return self._known.get(scales.values.tobytes(), lambda: self._weigh(scales))

    def _weigh(self, scales: Scales) -> Weighted:
        visible, weights, amplitudes = self.visible, scales.weights(), scales.amplitudes(self.groups)
        whole = np.tensordot(weights, self.products, axes=1)
        inner = amplitudes[:, None] * whole[visible:, visible:] * amplitudes
        scale = np.sqrt(1.0 + np.diag(inner))
        root = scale[:, None] * factor(np.eye(len(scale)) + inner, scale)
        half = solve_triangular(root, amplitudes[:, None] * whole[visible:, :visible], lower=True)
        determinant = 2.0 * float(np.log(np.diag(root)).sum()) - float(self.counts @ np.log(weights))
        return Weighted(whole[:visible, :visible] - half.T @ half, determinant, whole, half, root)

    def discrepancy(self, scales: Scales, direction: Array) -> Array:
        """Most probable torque without a name, (R,). `direction`: (1 + k,), 1, then minus the columns' parameters."""
        known = self.weighted(scales)
        seen = solve_triangular(known.root, known.half @ direction, lower=True, trans="T")
        return np.asarray((scales.amplitudes(self.groups) * seen) @ self.rows[self.visible :])

    def reduced(self, scales: Scales, crossed: Array, mutual: Array) -> tuple[Array, Array]:
        """Those of `against`, `crossed` and `mutual`, with target and columns, (g, 1 + k) and (s, c, c), after C⁻¹."""
        visible, weights = self.visible, scales.weights()
        known = self.weighted(scales)
        own, fellows = np.tensordot(weights, crossed, axes=1), np.tensordot(weights, mutual, axes=1)
        amplitudes = scales.amplitudes(self.groups)
        seen = solve_triangular(known.root, amplitudes[:, None] * own[:, visible:].T, lower=True)
        by_shape = seen.reshape(len(seen), *fellows.shape[:2])
        return own[:, :visible] - seen.T @ known.half, fellows - np.einsum("bsc,bsd->scd", by_shape, by_shape)

    def slopes(self, scales: Scales, direction: Array, covariance: Array) -> Array:
        """∂/∂scales of uᵀ Z C⁻¹ Zᵀ u + tr(V X C⁻¹ Xᵀ) + log det C, (s,), `direction` u, `covariance` V, (k, k)."""
        visible, weights, counts = self.visible, scales.weights(), self.counts
        amplitudes = scales.amplitudes(self.groups)
        known = self.weighted(scales)
        whole = known.whole
        inverse, _ = dpotri(known.root, lower=True)
        kernel = amplitudes[:, None] * (inverse + np.tril(inverse, -1).T) * amplitudes
        taken = kernel @ whole[visible:, :visible]
        spread = np.zeros((visible, visible))
        spread[1:, 1:] = covariance
        spread += np.outer(direction, direction)
        spilled = taken @ spread
        squares = spilled @ taken.T
        seen = np.array(
            [
                np.vdot(own[:visible, :visible], spread)
                - 2.0 * np.vdot(own[visible:, :visible], spilled)
                + np.vdot(own[visible:, visible:], squares)
                for own in self.products
            ]
        )
        traces = np.array([np.vdot(own[visible:, visible:], kernel) for own in self.products])
        by_class = weights * (counts - weights * (traces + seen))
        inside = whole[visible:, :visible] - whole[visible:, visible:] @ taken
        energy = np.sum((inside @ spread) * inside, axis=1)
        mutual = whole[visible:, visible:]
        of_feature = 2.0 * amplitudes**2 * (np.diag(mutual) - energy - np.sum((mutual @ kernel) * mutual, axis=1))
        return scales.collect(by_class, of_feature, self.groups)


def _split(rows: Array, bounds: Index) -> list[Array]:
    """Rows (..., R) of each class."""
    return np.split(rows, bounds[1:-1], axis=-1)
