"""A model linear in its parameters, its evidence, and the scales under which the data are most probable.

    y_j = X_j Θ + e_j,   e_j ~ N(0, C_j),   Θ ~ N(μ, P⁻¹)

    2 log p(y) = -(y - Xμ)ᵀ C⁻¹ (y - Xμ) + bᵀ A⁻¹ b - log det C - log det A + log det P,   A = P + XᵀC⁻¹X,

b = XᵀC⁻¹(y - Xμ): Θ is integrated out (MacKay 1992; Kass & Raftery 1995). Scales of C are those of highest evidence.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from tauscope.diagnosis.evidence.moments import Index, JointMoments, Weighted, factor
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.recording.recording import Array

STEPS = 30  # most steps to the most probable scales of a joint
SETTLED = 0.02  # change of the log evidence at which a step is the last
CERTAIN = 1e6  # factor by which a parameter that is held is believed more precisely


@dataclass(frozen=True, eq=False)
class Posterior:
    """Mean and covariance of the parameters, and the log evidence."""

    mean: Array  # (p,), of Θ
    factor: Array  # (p, p), lower Cholesky factor of A / (s sᵀ)
    scale: Array  # (p,), s
    log_evidence: float

    def solve(self, right: Array) -> Array:
        """A⁻¹ r. `right`: (p,) or (p, k), r."""
        scale = self.scale if right.ndim == 1 else self.scale[:, None]
        return np.asarray(cho_solve((self.factor, True), right / scale) / scale)

    @property
    def spread(self) -> Array:
        """S with S Sᵀ = A⁻¹, (p, p)."""
        root = solve_triangular(self.factor, np.eye(len(self.mean)), lower=True, trans="T")
        return np.asarray(root / self.scale[:, None])

    @property
    def covariance(self) -> Array:
        """A⁻¹, (p, p)."""
        lower, _ = dpotri(self.factor, lower=True)
        return np.asarray((lower + np.tril(lower, -1).T) / np.outer(self.scale, self.scale))


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Rows of all joints, and what is believed of the parameters."""

    joints: tuple[JointMoments, ...]
    mean: Array  # (p,), μ
    precision: Array  # (p, p), P

    @property
    def size(self) -> int:
        """Number of parameters p."""
        return len(self.mean)

    def extend(self, columns: Mapping[int, Array], mean: Array, std: Array) -> "LinearModel":
        """The same with more white columns, (c, R_j) by joint, of parameters of believed mean and std, (c,)."""
        index = np.arange(self.size, self.size + len(mean))
        joints = tuple(
            own.extend(index, columns[joint]) if joint in columns else own for joint, own in enumerate(self.joints)
        )
        precision = np.pad(self.precision, (0, len(mean)))
        precision[index, index] = 1.0 / std**2
        return LinearModel(joints, np.concatenate([self.mean, mean]), precision)

    def hold(self, places: Index, values: Array) -> "LinearModel":
        """The same with parameters at `places`, (c,), believed to have `values`, (c,)."""
        precision, right = self.precision.copy(), self.precision @ self.mean
        certain = CERTAIN * np.diag(self.precision)[places]
        precision[places, places] += certain
        right[places] += certain * values
        return replace(self, mean=np.linalg.solve(precision, right), precision=precision)

    def without(self, places: Index, values: Array) -> "LinearModel":
        """The same with parameters at `places`, (c,), held at `values`, (c,); they stay, with no column."""
        return replace(self, joints=tuple(own.without(places, values) for own in self.joints))

    def posterior(self, scales: Sequence[Scales]) -> Posterior:
        """Parameters and evidence under given scales, one entry a joint."""
        return self._solve(self._sum(scales, range(len(self.joints)), self._sum_prior()))

    def evidence(self, scales: Sequence[Scales]) -> float:
        """Log evidence of data and scales."""
        return self.posterior(scales).log_evidence - sum(each.penalty() for each in scales)

    def most_probable(
        self, scales: Sequence[Scales], joints: Collection[int], *, anew: bool = True
    ) -> tuple[Scales, ...]:
        """The scales of highest evidence, joint by joint; `anew`: from a covariance without discrepancy, too."""
        found = list(scales)
        for joint in joints:
            others = [place for place in range(len(self.joints)) if place != joint]
            rest = self._sum(found, others, self._sum_prior())
            found[joint] = self._tune(joint, found[joint], rest, anew=anew)
        return tuple(found)

    def _tune(self, joint: int, start: Scales, rest: "_Sum", *, anew: bool) -> Scales:
        """Scales of one joint beside what the others say."""
        own = self.joints[joint]
        seen, every = rest.marginal(own.index), np.arange(len(own.index))

        def objective(values: Array) -> tuple[float, Array]:
            scales = replace(start, values=values)
            posterior = self._solve(seen.add(every, own.weighted(scales)))
            direction = np.concatenate([[1.0], -posterior.mean])
            slopes = 0.5 * own.slopes(scales, direction, posterior.covariance) + scales.penalty_slopes()
            return scales.penalty() - posterior.log_evidence, slopes

        limits = start.bounds()
        low, high = np.array(limits).T
        starts = [start.values]
        if anew:
            starts.append(start.without_discrepancy(start.noise).values)
        ends = [
            minimize(
                objective,
                np.clip(values, low, high),
                jac=True,
                method="L-BFGS-B",
                bounds=limits,
                options={"maxiter": STEPS, "ftol": SETTLED / 1e4},
            )
            for values in starts
        ]
        return replace(start, values=min(ends, key=lambda each: float(each.fun)).x)

    @cached_property
    def _log_believed(self) -> float:
        """½ log det P."""
        scale = np.sqrt(np.diag(self.precision))
        return float(np.log(np.diag(factor(self.precision, scale)) * scale).sum())

    def _sum_prior(self) -> "_Sum":
        """The prior alone."""
        inner = self.precision @ self.mean
        return _Sum(self.precision, inner, float(self.mean @ inner), 0.0)

    def _sum(self, scales: Sequence[Scales] | Mapping[int, Scales], joints: Collection[int], start: "_Sum") -> "_Sum":
        """A, its right-hand side, energy and log det C with some joints more."""
        total = start
        for joint in joints:
            total = total.add(self.joints[joint].index, self.joints[joint].weighted(scales[joint]))
        return total

    def _solve(self, total: "_Sum") -> Posterior:
        scale = np.sqrt(np.diag(total.matrix))
        root = factor(total.matrix, scale)
        right = total.right / scale
        mean = cho_solve((root, True), right)
        gained = self._log_believed - float(np.log(np.diag(root) * scale).sum())
        value = 0.5 * (float(right @ mean) - total.energy - total.determinant) + gained
        return Posterior(mean / scale, root, scale, value)


@dataclass(frozen=True, eq=False)
class _Sum:
    """Sums over joints: A, XᵀC⁻¹y + Pμ, yᵀC⁻¹y + μᵀPμ, log det C."""

    matrix: Array
    right: Array
    energy: float
    determinant: float

    def add(self, index: Index, found: Weighted) -> "_Sum":
        """With one joint more, whose columns have places `index`, (k,)."""
        matrix, right = self.matrix.copy(), self.right.copy()
        matrix[np.ix_(index, index)] += found.products[1:, 1:]
        right[index] += found.products[1:, 0]
        energy = self.energy + float(found.products[0, 0])
        return _Sum(matrix, right, energy, self.determinant + found.log_determinant)

    def marginal(self, index: Index) -> "_Sum":
        """What is left for parameters of `index`, (k,), when all others are integrated out, less a constant."""
        others = np.setdiff1d(np.arange(len(self.right)), index)
        scale = np.sqrt(np.diag(self.matrix)[others])
        root = factor(self.matrix[np.ix_(others, others)], scale)
        crossed = np.column_stack([self.matrix[np.ix_(others, index)], self.right[others]]) / scale[:, None]
        taken = solve_triangular(root, crossed, lower=True)
        left = taken.T @ taken
        matrix = self.matrix[np.ix_(index, index)] - left[:-1, :-1]
        return _Sum(matrix, self.right[index] - left[:-1, -1], self.energy - left[-1, -1], self.determinant)
