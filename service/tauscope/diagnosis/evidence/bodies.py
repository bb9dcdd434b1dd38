"""What is believed of the links while a diagnosis looks for more: bodies near the stated ones, none impossible.

    log p(x) = -½ ‖W (x - μ)‖² + κ Σ_i log det J_i(x),

x the standard parameters of all links, J_i a link's 4x4 pseudo-inertia (Wensing, Kim & Slotine 2018). The determinant
keeps every link a body with no inequality, so that the evidence stays that of a normal distribution: at a body x it is
expanded to second order. κ = 1, so that the prior does not depend on the unit of mass (Jeffreys).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from tauscope.identification import Identification
from tauscope.identification.consistency.triangle import UPPER_TRIANGLE, congruence, triangle_of_parameters
from tauscope.identification.full_parameters import FullParameters
from tauscope.recording.recording import Array

WITHIN = 0.9  # part of the way to the nearest body without volume that one step may take
# Least part of the believed body's moments that a body keeps along every axis: with its square double numbers work.
THINNEST = 1e-6
ROUNDING = 1e-10  # least eigenvalue of a correlation matrix that rounding may have made negative
_ROWS, _COLUMNS = np.array(UPPER_TRIANGLE).T
_WEIGHT = np.where(_ROWS == _COLUMNS, 1.0, np.sqrt(2.0))
_TRIANGLE = triangle_of_parameters()


@dataclass(frozen=True, eq=False)
class NormalBodies:
    """The prior about one body, as normal distribution of the base parameters Θ_L = M x."""

    centre: Array  # (10 n,), of the links' standard parameters
    gain: Array  # (10 n, m), dx/dΘ_L of the most probable links
    mean: Array  # (m,), of the base parameters
    precision: Array  # (m, m), of the base parameters
    energy: float  # -2 log p of the body, but for a constant
    # log of the probability that the normal distribution stands for, alike: expanded elsewhere it is another
    log_mass: float

    def links(self, base: Array) -> Array:
        """Most probable standard parameters of links with these base parameters, (10 n,). `base`: (m,), Θ_L."""
        return self.centre + self.gain @ (base - self.mean)


@dataclass(frozen=True, eq=False)
class BodyPrior:
    """The prior itself."""

    base: Array  # (m, 10 n), M
    mean: Array  # (10 n,), μ
    precision: Array  # (10 n, 10 n), WᵀW

    @staticmethod
    def of(identification: Identification) -> "BodyPrior":
        """The prior of an identification, as wide as its estimate believes it."""
        full, prior = FullParameters.of(identification.structure), identification.posterior.prior
        links = 10 * prior.link_count
        root = prior.root[:links, :links]
        return BodyPrior(full.map[: full.base_count, :links], prior.mean[:links], root.T @ root)

    def start(self, links: Array) -> Array:
        """Bodies with some volume near given ones, which may have none. `links`: (10 n,), standard parameters."""
        near = WITHIN * links + (1.0 - WITHIN) * self.mean
        for own in _each(near):
            if np.linalg.eigvalsh(pseudo_inertia(near[own]))[0] <= 0.0:
                near[own] = self.mean[own]
        return near

    def about(self, links: Array) -> NormalBodies:
        """The prior to second order about bodies. `links`: (10 n,), standard parameters of bodies with volume."""
        precision, slope = self.precision.copy(), self.precision @ (links - self.mean)
        for own in _each(links):
            inverse = np.asarray(np.linalg.inv(pseudo_inertia(links[own])), dtype=np.float64)
            precision[own, own] += _TRIANGLE.T @ congruence(inverse) @ _TRIANGLE
            slope[own] -= _TRIANGLE.T @ (_WEIGHT * inverse[_ROWS, _COLUMNS])
        scale = 1.0 / np.sqrt(np.diag(precision))
        factor = _factor(scale[:, None] * precision * scale)
        step = scale * cho_solve(factor, scale * slope)
        spread = scale[:, None] * cho_solve(factor, (self.base * scale).T)
        of_base = _inverse(self.base @ spread)
        centre, energy = links - step, self._energy(links)
        determinant = 2.0 * float(np.sum(np.log(np.diag(factor[0])) - np.log(scale)))
        log_mass = 0.5 * (float(slope @ step) - energy - determinant)
        return NormalBodies(centre, spread @ of_base, self.base @ centre, of_base, energy, log_mass)

    def _energy(self, links: Array) -> float:
        off = links - self.mean
        volumes = sum(float(np.linalg.slogdet(pseudo_inertia(links[own]))[1]) for own in _each(links))
        return float(off @ self.precision @ off) - 2.0 * volumes

    def share(self, links: Array, step: Array) -> float:
        """Part of a step of links, (10 n,) each, that leaves every one its volume, at most 1."""
        share = 1.0
        for own in _each(links):
            room = pseudo_inertia(links[own] - THINNEST * self.mean[own])
            if np.linalg.eigvalsh(room)[0] <= np.finfo(float).eps * np.trace(room):
                return 0.0  # as thin as may be
            root = cholesky(room, lower=True)
            half = solve_triangular(root, pseudo_inertia(step[own]), lower=True)
            least = float(np.linalg.eigvalsh(solve_triangular(root, half.T, lower=True))[0])
            share = min(share, -WITHIN / least) if least < 0.0 else share
        return share


def pseudo_inertia(parameters: Array) -> Array:
    """J of one link, (4, 4). `parameters`: (10,), its standard parameters."""
    values = (_TRIANGLE @ parameters) / _WEIGHT
    found = np.empty((4, 4))
    found[_ROWS, _COLUMNS] = found[_COLUMNS, _ROWS] = values
    return found


def _each(links: Array) -> list[slice]:
    """Where each link's parameters are."""
    return [slice(first, first + 10) for first in range(0, len(links), 10)]


def _factor(correlation: Array) -> tuple[Array, bool]:
    """Cholesky factor of a correlation matrix, whose least eigenvalues rounding may have made negative."""
    try:
        return cho_factor(correlation)
    except np.linalg.LinAlgError:
        even = 0.5 * (correlation + correlation.T)
        lost = max(-float(np.linalg.eigvalsh(even)[0]), 0.0)
        return cho_factor(even + (2.0 * lost + ROUNDING) * np.eye(len(even)))


def _inverse(matrix: Array) -> Array:
    """Inverse of a positive definite matrix whose rows have different units."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    size = len(matrix)
    factor = _factor(scale[:, None] * matrix * scale)
    return np.asarray(scale[:, None] * cho_solve(factor, np.eye(size)) * scale)
