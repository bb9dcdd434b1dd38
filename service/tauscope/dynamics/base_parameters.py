"""Base parameters: which standard parameters, alone or combined, the torques depend on (seed paper, section 4.1).

The regressor's columns are linearly dependent for reasons of geometry alone. Equations (10) to (14) find the leading
columns j_L of its reduced row echelon form and express the others by them, K = L B, so that τ = L (Θ_L + B Θ_K).

Two measures keep this sound where a file's angles are not exact to the last digit:

* A right angle given as 1.5708 is meant to be right: angles within `RIGHT_ANGLE` of one are taken for it, and lengths
  below a micrometre for zero. Otherwise every such angle adds terms of some 1e-6 to the expressions.
* A column leads only where a good part of it, `_LEADING`, is not a combination of columns to its left; what this leaves
  unexplained is then taken from the leftmost columns that show it well. For a UR5 whose right angles are given as 1.57
  the strict rule leads to a condition number of 1e6 and coefficients as large; this one, to 5 and 3, as for exact
  angles. Where no axes are nearly parallel the two rules are one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics.chain_step import Array, euler_zxz
from tauscope.dynamics.regressor import torque_regressor
from tauscope.robot.kinematics import rotation_about
from tauscope.robot.robot import STANDARD_PARAMETERS, JointType, Placement, Robot

Columns = NDArray[np.intp]

RIGHT_ANGLE = 1e-5  # angles this close to a right one are meant to be right [rad]: 1.5708 is 3.7e-6 off
_LENGTH = 1e-6  # lengths below this are rounding of the file [m]
_LEADING = (1e-2, 1e-4, 1e-6, 1e-8)
"""Shares of a column, relative to the largest of its unit, that have to be new for it to lead: first choice to last.

Below the last a column is a combination of others, or, where there are none, zero."""

_ROUNDING = 1e-12  # share of the largest column of any unit below which a column is zero: all columns of a unit may be
_SHARE = 1e-9  # share of a column below which a term of its combination is rounding

# Links 1 to j have 10 j parameters that show at joints 1 to j alone: twenty states give twice as many equations.
_STATES = 20

# Inertia, mass and first moment: columns of one unit each, comparable in size.
_UNITS = (slice(0, 6), slice(6, 7), slice(7, 10))


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """The base parameters Θ* = Θ_L + B Θ_K of an arm, equation (14), m of them."""

    independent_columns: Columns  # (m,) int, j_L: the standard parameter that leads each, counted over all links from 0
    dependent_columns: Columns  # (k,) int, j_K: standard parameters that appear in combinations only
    unidentifiable_columns: Columns  # (u,) int, standard parameters that no motion of the arm shows
    combination: Array  # (m, k), B, equation (12)
    names: tuple[str, ...]
    expressions: tuple[str, ...]
    terms: tuple[Mapping[str, float], ...]
    unidentifiable: tuple[str, ...]
    first_links: tuple[int, ...]  # first link that each joint moves, from 0

    def is_independent(self, index: int) -> bool:
        """Whether base parameter `index` is one standard parameter alone: its row of B is zero."""
        return not np.any(self.combination[index])

    def outward(self, joint: int) -> slice:
        """Base parameters of the links that a joint moves: from its own link's first one to the last of all."""
        return slice(
            int(np.searchsorted(self.independent_columns, len(STANDARD_PARAMETERS) * self.first_links[joint])), None
        )

    def project(self, parameters: Array) -> Array:
        """Base parameters Θ* = Θ_L + B Θ_K, (m,), equation (14), of `parameters`, (10 n,)."""
        return parameters[self.independent_columns] + self.combination @ parameters[self.dependent_columns]


def base_parameters(robot: Robot, *, seed: int = 0) -> BaseParameters:
    """Base parameters of an arm from its geometry alone, equations (10) to (14)."""
    triangle = _column_triangle(_as_meant(robot), np.random.default_rng(seed))
    sizes = np.linalg.norm(triangle, axis=0)
    scales = np.maximum(_largest_of_unit(sizes), _ROUNDING / _LEADING[-1] * sizes.max())
    null = sizes <= _LEADING[-1] * scales
    independent = _leading_columns(triangle, scales, np.flatnonzero(~null))
    dependent = np.setdiff1d(np.flatnonzero(~null), independent)
    combination = _combination(triangle[:, independent], triangle[:, dependent])
    standard = tuple(f"{name}{link + 1}" for link in range(robot.link_count) for name in STANDARD_PARAMETERS)
    terms = tuple(_terms(standard, lead, dependent, row) for lead, row in zip(independent, combination, strict=True))
    return BaseParameters(
        independent_columns=independent,
        dependent_columns=dependent,
        unidentifiable_columns=np.flatnonzero(null),
        combination=combination,
        names=tuple(standard[column] for column in independent),
        expressions=tuple(_expression(of_one) for of_one in terms),
        terms=terms,
        unidentifiable=tuple(standard[column] for column in np.flatnonzero(null)),
        first_links=robot.first_links,
    )


def _as_meant(robot: Robot) -> Robot:
    """The arm with its nearly right angles made right, and without lengths and gravity components that are rounding."""

    def exact(placement: Placement) -> Placement:
        rotation = placement.rotation
        for _ in range(2):  # A tilt made zero leaves one turn of two, which may be nearly right only now.
            first, about_x, last = (_right_angle(angle) for angle in euler_zxz(rotation))
            rotation = rotation_about(2, first) @ rotation_about(0, about_x) @ rotation_about(2, last)
        reach = float(np.linalg.norm(placement.translation))
        return Placement(rotation, _without_small(placement.translation, max(_LENGTH, RIGHT_ANGLE * reach)))

    segments = tuple(replace(each, before=exact(each.before), after=exact(each.after)) for each in robot.segments)
    gravity = _without_small(robot.gravity, RIGHT_ANGLE * float(np.linalg.norm(robot.gravity)))
    return replace(robot, segments=segments, gravity=gravity)


def _right_angle(angle: float) -> float:
    nearest = round(angle / (np.pi / 2)) * (np.pi / 2)
    return nearest if abs(angle - nearest) <= RIGHT_ANGLE else angle


def _without_small(values: Array, tolerance: float) -> Array:
    return np.where(np.abs(values) <= tolerance, 0.0, values)


def _column_triangle(robot: Robot, rng: np.random.Generator) -> Array:
    """Triangular factor of Φ at random states: its columns have the same lengths and angles as Φ's.

    The states go all the way round, whatever the limits: a relation between columns that holds in some range holds
    everywhere. Velocities and accelerations are such that inertia, centrifugal and gravity terms have similar size.
    """
    shape = (_STATES, robot.joint_count)
    reach = [np.pi if joint.type is JointType.REVOLUTE else 1.0 for joint in robot.joints]
    q, qd, qdd = (rng.uniform(-1.0, 1.0, shape) * scale for scale in (np.array(reach), 4.0, 15.0))
    phi = torque_regressor(robot, q, qd, qdd)
    return np.asarray(np.linalg.qr(phi.reshape(-1, phi.shape[-1]), mode="r"))


def _largest_of_unit(sizes: Array) -> Array:
    """For each column the largest size among the columns of its unit."""
    per_link = sizes.reshape(-1, len(STANDARD_PARAMETERS))
    largest = np.empty_like(per_link)
    for unit in _UNITS:
        largest[:, unit] = per_link[:, unit].max()
    return largest.ravel()


def _leading_columns(triangle: Array, scales: Array, candidates: Columns) -> Columns:
    """Columns that are not a combination of those to their left: the pivots of the row echelon form, equation (10)."""
    basis = np.empty((len(triangle), 0))
    leading: list[int] = []
    for share in _LEADING:
        unexplained = np.linalg.norm(_outside(basis, triangle[:, candidates]), axis=0)
        if np.all(unexplained <= _LEADING[-1] * scales[candidates]):
            break
        for column in candidates:
            rest = _outside(basis, triangle[:, column])
            size = np.linalg.norm(rest)
            if size > share * scales[column]:
                basis = np.column_stack([basis, rest / size])
                leading.append(int(column))
    return np.array(sorted(leading), dtype=np.intp)


def _outside(basis: Array, vectors: Array) -> Array:
    """The part of one or more vectors that an orthonormal basis does not span."""
    for _ in range(2):  # Once more takes away what rounding left of the first time.
        vectors = vectors - basis @ (basis.T @ vectors)
    return vectors


def _combination(leading: Array, others: Array) -> Array:
    """B of K = L B, equations (11) and (12)."""
    combination = np.asarray(np.linalg.lstsq(leading, others)[0], dtype=np.float64)
    share = np.abs(combination) * np.linalg.norm(leading, axis=0)[:, None] / np.linalg.norm(others, axis=0)
    return np.where(share > _SHARE, _without_rounding(combination), 0.0)


def _without_rounding(coefficients: Array) -> Array:
    """Coefficients within 1e-10 of a multiple of 1/64 made exact."""
    nearest = np.round(coefficients * 64) / 64
    return np.where(np.abs(coefficients - nearest) < 1e-10, nearest, coefficients)


def _terms(standard: tuple[str, ...], lead: int, dependent: Columns, row: Array) -> dict[str, float]:
    """The leading parameter, then the others as the paper orders them: all inertias, all masses, all first moments."""
    used = np.flatnonzero(row)
    used = used[np.argsort(dependent[used] % len(STANDARD_PARAMETERS), kind="stable")]
    return {standard[lead]: 1.0} | {standard[dependent[at]]: float(row[at]) for at in used}


def _expression(terms: Mapping[str, float]) -> str:
    """The terms as text: ``Ixx2 - Iyy2 - 0.5*msx2``."""
    (lead, _), *others = terms.items()
    parts = [lead]
    for name, coefficient in others:
        size = f"{float(f'{abs(coefficient):.12g}'):.6g}"  # 0.04638875 is a tie: rounding must not decide it
        parts.append(f"{'-' if coefficient < 0 else '+'} {name if size == '1' else f'{size}*{name}'}")
    return " ".join(parts)
