"""Bodies and friction after the data: a normal posterior whose noise and width of prior the evidence chooses.

    y_j = A_j Θ + e_j,   e_j of long-run variance ρ_j σ_j²,   Θ ~ N(μ, P(w))

A residual that is coloured counts for fewer rows: ρ_j is its spectral density at frequency zero over that of white
noise. σ_j is estimated as by expectation maximisation, N_j σ_j² = ‖A_j Θ - y_j‖² + tr(A_j S A_jᵀ), S the posterior
covariance: no joint takes the freedom of its parameters for precision. The width w of the bodies' prior is the one
under which the data are most probable (MacKay 1992), and never narrow. Data that determine a parameter overrule the
prior; a parameter that they leave open stays at what was believed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve_triangular, svd

from tauscope.dynamics.friction import FRICTION_COLUMNS
from tauscope.identification.consistency import Prior, plausible_prior
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.least_squares import Estimator, JointFactor, least_std, stacked_factor, torque_rms
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

WIDTHS = np.geomspace(1 / 16, 32.0, 19)  # candidates of w: at 2 a link's mass is believed to as much as all of itself
# The estimate believes no body more than this, however well the stated ones agree with the data so far: w is at least
# as large in it, while its uncertainty is that of the w which the data show.
WIDE = 2.0
ROUNDS = 20  # most rounds of noise, width and parameters…
SETTLED = 1e-3  # …which end where no joint's noise changes by more than this share
DETERMINED = 0.9  # share of the prior's variance that data take from a parameter which they determine


@dataclass(frozen=True, eq=False)
class Posterior:
    """What prior and data together say of the parameters, before bodies and friction restrict them."""

    prior: Prior
    doubt: Array  # (p,), deviation from the prior that the data show, in its standard deviations
    noise_std: Array  # (n,), σ_j of a row in the common band
    weights: Array  # (n,), 1/(σ_j √ρ_j), by which the joints' equations are multiplied
    factor: Array  # (p, p), R of the data's weighted equations
    target: Array  # (p,), z of these
    mean: Array
    covariance: Array  # (p, p), S of the posterior
    precision: Array  # (p, p), P⁻¹ of the prior

    @property
    def learnt(self) -> Array:
        """Share of every parameter's prior variance that the data took away, (p,)."""
        return 1.0 - np.diag(self.covariance) / np.diag(np.linalg.inv(self.precision))

    @property
    def freedom(self) -> float:
        """Number of parameters that the data determine: p - tr(S P⁻¹)."""
        return float(len(self.mean) - np.sum(self.covariance * self.precision))


def infer(
    structure: ModelStructure,
    factors: tuple[JointFactor, ...],
    ratios: Array | None = None,
    estimator: Estimator = Estimator.WLS,
) -> Posterior:
    """The posterior; `ratios`: (n,) or None, ρ_j, long-run over white variance of residuals, ones where not known."""
    full = FullParameters.of(structure)
    colour = np.ones(len(factors)) if ratios is None else np.sqrt(ratios)
    std = torque_rms(factors)  # from above: beside a noise of nothing every parameter looks determined
    factor, target = _stack(factors, structure.size, std * colour)
    prior = plausible_prior(structure.robot, factor @ full.map, target, full.friction)
    centre, root = _project(full, prior)
    for _ in range(ROUNDS):
        width, evident, mean, covariance = _most_probable(centre, root, full.base_count, factor, target)
        before, std = std, _noise_std(factors, mean, covariance, estimator)
        factor, target = _stack(factors, structure.size, std * colour)
        if np.all(np.abs(std - before) <= SETTLED * before):
            break
    width, evident, mean, covariance = _most_probable(centre, root, full.base_count, factor, target)
    half = solve_triangular(_widen(root, full.base_count, width), np.eye(len(mean)), lower=True)
    precision = half.T @ half
    learnt = 1.0 - np.diag(covariance) * np.diag(precision)
    doubt = _friction_doubt(structure, mean * np.sqrt(np.diag(precision)), learnt)
    doubt[: structure.base_count] = evident / width
    weights = 1.0 / (std * colour)
    return Posterior(prior.widen(width), doubt, std, weights, factor, target, mean, covariance, precision)


def _friction_doubt(structure: ModelStructure, deviation: Array, learnt: Array) -> Array:
    """Deviation from the prior that coefficients of a kind show at the joints whose data determine them, (p,)."""
    doubt = np.ones(structure.size)
    for name in FRICTION_COLUMNS:
        columns = [*structure.coefficients(name).values()]
        known = [column for column in columns if learnt[column] > DETERMINED]
        if known:
            doubt[columns] = min(np.sqrt(np.mean(deviation[known] ** 2)), 1.0)
    return doubt


def _stack(factors: tuple[JointFactor, ...], size: int, std: Array) -> tuple[Array, Array]:
    """R and z of the weighted equations of all joints."""
    triangle = stacked_factor(factors, size, std)
    return triangle[:-1, :-1], triangle[:-1, -1]


def _project(full: FullParameters, prior: Prior) -> tuple[Array, Array]:
    """Mean of the model's columns before any data, and C with C Cᵀ their covariance at w = 1; C is lower triangular."""
    spread = full.map @ np.linalg.inv(prior.root)
    return full.map @ prior.mean, np.asarray(np.linalg.cholesky(spread @ spread.T), dtype=np.float64)


def _widen(root: Array, bodies: int, width: float) -> Array:
    """C at another width: friction, which has no covariance with bodies, keeps its own."""
    return root * np.append(np.full(bodies, width), np.ones(len(root) - bodies))


def _most_probable(
    mean: Array, root: Array, bodies: int, factor: Array, target: Array
) -> tuple[float, float, Array, Array]:
    """Width of the prior, width of highest evidence, and mean and covariance.

    Friction, whose prior does not depend on w, is eliminated first; the rest is diagonal in the singular vectors of
    R C, C Cᵀ the prior covariance of the base parameters at w = 1: every width costs a sum.
    """
    white = np.column_stack([factor @ root, target - factor @ mean])
    friction = white[:, bodies:-1]
    size = friction.shape[1]
    rows = np.block([[friction, white[:, :bodies], white[:, -1:]], [np.eye(size), np.zeros((size, bodies + 1))]])
    reduced = np.asarray(qr(rows, mode="r")[0])[size:, size:]
    left, singular, _ = svd(reduced[:, :-1], full_matrices=False)
    along = left.T @ reduced[:, -1]
    gain = 1.0 + np.outer(WIDTHS**2, singular**2)
    evidence = -0.5 * np.sum(along**2 / gain + np.log(gain), axis=1)
    width = max(float(WIDTHS[int(np.argmax(evidence))]), WIDE)
    weight = np.exp(evidence - evidence.max())
    evident = float(np.sqrt(weight @ WIDTHS**2 / weight.sum()))
    root = _widen(root, bodies, width)
    stacked = np.vstack([factor @ root, np.eye(len(mean))])
    whole = np.column_stack([stacked, np.append(target - factor @ mean, np.zeros(len(mean)))])
    triangle = np.asarray(qr(whole, mode="r")[0])[: len(mean)]
    inverse = root @ solve_triangular(triangle[:, :-1], np.eye(len(mean)))
    return width, evident, mean + inverse @ triangle[:, -1], inverse @ inverse.T


def _noise_std(factors: tuple[JointFactor, ...], parameters: Array, covariance: Array, estimator: Estimator) -> Array:
    """σ_j by expectation maximisation, (n,); one for all joints where they are not weighted."""
    squares = []
    for factor in factors:
        columns = factor.triangle[:, :-1]
        own = covariance[np.ix_(factor.columns, factor.columns)]
        squares.append(factor.squared_residual(parameters) + max(float(np.sum((columns @ own) * columns)), 0.0))
    rows = np.array([factor.rows for factor in factors])
    if estimator is Estimator.LS:
        return np.full(len(factors), np.sqrt(sum(squares) / rows.sum()))
    return np.maximum(np.sqrt(squares / rows), least_std(factors))
