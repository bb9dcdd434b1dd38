"""Products of one joint's rows: all that evidence asks of them, whatever the scales of the covariance."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from tauscope.diagnosis.evidence.scales import Scales
from tauscope.recording.recording import Array

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Weighted:
    """Zᵀ C⁻¹ Z of a joint's target and columns, and log det C."""

    products: Array
    log_determinant: float


@dataclass(frozen=True, eq=False)
class JointMoments:
    """Rows Z = [target; columns; features] of one joint, in classes of rest, and their products in each class.

    index : (k,) int
        places of the columns among all parameters
    rows : (1 + k + b, R) float64
        white rows
    bounds : (K + 1,) int
        where each class begins
    products : (K, 1 + k + b, 1 + k + b) float64
        Z Zᵀ of each class
    counts : (K,) float64
        independent rows of each class; one that tells less than a whole one counts as a part
    groups : (b,) int
        group of each feature; -1 for a column error of known size
    """

    index: Index
    rows: Array
    bounds: Index
    products: Array
    counts: Array
    groups: Index

    @staticmethod
    def of(
        index: Index,
        target: Array,
        columns: Array,
        features: Array,
        bounds: Index,
        counts: Array,
        groups: Index,
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
        """Products of other columns with Z, (K, g, 1 + k + b), and of each with itself and its fellows, (K, s, c, c).

        Parameters
        ----------
        columns : (s, c, R) float64
            c columns for each of s shapes, g = s c
        """
        flat = columns.reshape(-1, columns.shape[-1])
        parts = list(zip(_split(flat, self.bounds), _split(self.rows, self.bounds), strict=True))
        mutual = [own.reshape(*columns.shape[:2], -1) for own, _ in parts]
        return np.stack([own @ rows.T for own, rows in parts]), np.stack([m @ m.transpose(0, 2, 1) for m in mutual])

    def extend(self, index: Index, columns: Array) -> "JointMoments":
        """The same with columns of more parameters.

        Parameters
        ----------
        index : (c,) int
            their places among all parameters
        columns : (c, R) float64
            white rows
        """
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
        """The same with some parameters held at a value.

        Parameters
        ----------
        places : (c,) int
            their places among all parameters
        values : (c,) float64
            what they are held at
        """
        held = np.isin(self.index, places)
        value_of = dict(zip(places.tolist(), values.tolist(), strict=True))
        change = np.eye(len(self.rows))
        change[0, 1 : self.visible][held] = [-value_of[place] for place in self.index[held].tolist()]
        change = change[np.concatenate([[True], ~held, np.ones(len(self.rows) - self.visible, dtype=bool)])]
        return replace(
            self, index=self.index[~held], rows=change @ self.rows, products=change @ self.products @ change.T
        )

    def weighted(self, scales: Scales) -> Weighted:
        """Zᵀ C⁻¹ Z by Woodbury's identity.

        C = σ² D + B A² Bᵀ with D = 1 + r² c² of a row's class, A the amplitudes of the features B.
        """
        visible = self.visible
        weights = scales.weights()
        whole = np.tensordot(weights, self.products, axes=1)
        half, root = self._half(whole, scales)
        products = whole[:visible, :visible] - half.T @ half
        determinant = 2.0 * float(np.log(np.diag(root)).sum()) - float(self.counts @ np.log(weights))
        return Weighted(products, determinant)

    def discrepancy(self, scales: Scales, direction: Array) -> Array:
        """Most probable torque without a name, (R,).

        Parameters
        ----------
        direction : (1 + k,) float64
            1, then minus the columns' parameters
        """
        visible, amplitudes = self.visible, scales.amplitudes(self.groups)
        whole = np.tensordot(scales.weights(), self.products, axes=1)
        inner = np.eye(len(amplitudes)) + amplitudes[:, None] * whole[visible:, visible:] * amplitudes
        seen = amplitudes * (whole[visible:, :visible] @ direction)
        return (amplitudes * np.linalg.solve(inner, seen)) @ self.rows[visible:]

    def _half(self, whole: Array, scales: Scales) -> tuple[Array, Array]:
        """K^(-1/2) A Bᵀ W Z of target and columns, and K^(1/2) with K = 1 + A Bᵀ W B A."""
        visible = self.visible
        amplitudes = scales.amplitudes(self.groups)
        inner = amplitudes[:, None] * whole[visible:, visible:] * amplitudes
        root = np.linalg.cholesky(np.eye(len(amplitudes)) + inner)
        outer = amplitudes[:, None] * whole[visible:, :visible]
        half = solve_triangular(root, outer, lower=True)
        return np.asarray(half, dtype=np.float64), np.asarray(root, dtype=np.float64)

    def reduced(self, scales: Scales, crossed: Array, mutual: Array) -> tuple[Array, Array]:
        """Products of other columns with target and columns, (g, 1 + k), and of their fellows, (s, c, c), after C⁻¹.

        Parameters
        ----------
        crossed, mutual : (K, g, 1 + k + b), (K, s, c, c) float64
            as of `against`
        """
        visible, weights = self.visible, scales.weights()
        half, root = self._half(np.tensordot(weights, self.products, axes=1), scales)
        own, fellows = np.tensordot(weights, crossed, axes=1), np.tensordot(weights, mutual, axes=1)
        amplitudes = scales.amplitudes(self.groups)
        seen = solve_triangular(root, amplitudes[:, None] * own[:, visible:].T, lower=True)
        by_shape = seen.reshape(len(seen), *fellows.shape[:2])
        return own[:, :visible] - seen.T @ half, fellows - np.einsum("bsc,bsd->scd", by_shape, by_shape)

    def slopes(self, scales: Scales, direction: Array, covariance: Array) -> Array:
        """Slopes of uᵀ Z C⁻¹ Zᵀ u + tr(V X C⁻¹ Xᵀ) + log det C in each of the scales, (s,).

        Parameters
        ----------
        direction : (1 + k,) float64
            u
        covariance : (k, k) float64
            V, of the columns' parameters
        """
        visible, weights, counts = self.visible, scales.weights(), self.counts
        amplitudes = scales.amplitudes(self.groups)
        whole = np.tensordot(weights, self.products, axes=1)
        inner = np.eye(len(amplitudes)) + amplitudes[:, None] * whole[visible:, visible:] * amplitudes
        inverse = np.linalg.inv(inner)
        kernel = amplitudes[:, None] * inverse * amplitudes
        taken = kernel @ whole[visible:, :visible]
        spread = np.zeros((visible, visible))
        spread[1:, 1:] = covariance
        spread += np.outer(direction, direction)
        by_class = np.empty(len(weights))
        for place, (weight, own) in enumerate(zip(weights, self.products, strict=True)):
            mixed = own[:visible, visible:] @ taken
            seen = own[:visible, :visible] - mixed - mixed.T + taken.T @ own[visible:, visible:] @ taken
            trace = counts[place] - weight * float(np.sum(own[visible:, visible:] * kernel))
            by_class[place] = trace * weight - weight**2 * float(np.sum(seen * spread))
        inside = whole[visible:, :visible] - whole[visible:, visible:] @ taken
        energy = np.sum((inside @ spread) * inside, axis=1)
        mutual = whole[visible:, visible:]
        of_feature = 2.0 * amplitudes**2 * (np.diag(mutual) - energy - np.sum((mutual @ kernel) * mutual, axis=1))
        return scales.collect(by_class, of_feature, self.groups)


def _split(rows: Array, bounds: Index) -> list[Array]:
    """Rows (..., R) of each class."""
    return np.split(rows, bounds[1:-1], axis=-1)
