"""The fewest wrong numbers of links that explain how base parameters differ from stated ones.

With d the surplus of the base parameters, C its covariance and x_g(β_g) the changes of some links' standard parameters,

    d = B Σ_g x_g(β_g) + e,   e ~ N(0, C),   β_g ~ N(0, V_g),

B the base parameters of each standard one. A set of changes is as good as the probability of d under it, β integrated
out: every number that may change costs what it could have been otherwise, so that one mass is preferred to ten moments
(MacKay 1992). One is added, exchanged or left out until nothing helps.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, optimize

from tauscope.diagnosis.against.link_changes import MASS, MOMENTS, LinkChange, link_changes
from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.recording.recording import Array

AS_GOOD = 3.0
"""Log odds within which another change is an equivalent explanation: one in twenty."""

PROGRESS = 1e-3
"""Gain in log probability from which an exchange is one."""

MOST_MOVES = 100
"""Additions and exchanges, at most."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """One change of a link with its most probable values.

    values : (k,) float64
        β
    covariance : (k, k) float64
        of β, beside all other changes
    effect : (m,) float64
        what it changes of the base parameters
    gain : float
        what it takes off the surplus [variances]
    log_odds : float
        posterior, that it is there
    equivalent : tuple of LinkChange
        changes that explain as much in its place
    """

    change: LinkChange
    values: Array
    covariance: Array
    effect: Array
    gain: float
    log_odds: float
    equivalent: tuple[LinkChange, ...]


@dataclass(frozen=True, eq=False)
class _Part:
    """A change at its values: its whitened torque parameters, and their slopes."""

    change: LinkChange
    values: Array
    effect: Array
    slope: Array


@dataclass(frozen=True, eq=False)
class _Set:
    """Changes together, whitened by what is known of d and believed of β."""

    problem: "Attribution"
    parts: tuple[_Part, ...]

    @cached_property
    def spread(self) -> Array:
        """Covariance of the whitened surplus with β integrated out."""
        whole = np.eye(len(self.problem.target))
        for part in self.parts:
            columns = part.slope * part.change.spread
            whole += columns @ columns.T
        return whole

    @cached_property
    def factor(self) -> Array:
        """Lower triangle of that."""
        return np.asarray(np.linalg.cholesky(self.spread), dtype=np.float64)

    @cached_property
    def rest(self) -> Array:
        """The surplus less the constant part of every change about its values, whitened."""
        left = self.problem.target.copy()
        for part in self.parts:
            left -= part.effect - part.slope @ part.values
        return linalg.solve_triangular(self.factor, left, lower=True)

    @cached_property
    def evidence(self) -> float:
        """Log probability of the surplus, but for a constant."""
        return -0.5 * float(self.rest @ self.rest) - float(np.log(np.diag(self.factor)).sum())

    def without(self, place: int) -> "_Set":
        """The same less one change."""
        return _Set(self.problem, (*self.parts[:place], *self.parts[place + 1 :]))

    def with_change(self, change: LinkChange) -> "_Set":
        """The same with one more change at its most probable values."""
        return _Set(self.problem, (*self.parts, self._fit(change)))

    def _fit(self, change: LinkChange) -> _Part:
        """A change at its most probable values beside the others."""
        seen = linalg.solve_triangular(self.factor, self.problem.columns[change.link], lower=True)
        values = _most_probable(change, seen, self.rest)
        columns = self.problem.columns[change.link]
        return _Part(change, values, columns @ change.change(values), columns @ change.slope(values))

    def settle(self) -> "_Set":
        """Every change fitted anew beside the others: values that are not linear move with them."""
        found = self
        for _ in range(len(self.parts) - 1):
            found = found.without(0).with_change(found.parts[0].change)
        return found


class Attribution:
    """A surplus of base parameters that is to be explained by links.

    Parameters
    ----------
    base : BaseParameters
        of the arm
    surplus : (m,) float64
        real less stated base parameters
    whitener : (r, m) float64
        W with Wᵀ W the inverse covariance of the surplus where that says anything
    links : (10 n,) float64 or None
        stated standard parameters; None where only their base parameters are known
    believed : (10 n, 10 n) float64
        covariance believed of them
    """

    def __init__(
        self, base: BaseParameters, surplus: Array, whitener: Array, links: Array | None, believed: Array
    ) -> None:
        count = len(believed) // 10
        self.target = whitener @ surplus
        self.base_columns = [_columns_of(base, link, count) for link in range(count)]
        self.columns = [whitener @ columns for columns in self.base_columns]
        self.changes: list[LinkChange] = []
        for link, columns in enumerate(self.columns):
            own = slice(10 * link, 10 * link + 10)
            stated = None if links is None else links[own]
            found = link_changes(link, stated, believed[own, own])
            self.changes += [each for each in found if np.any(columns @ each.slope(each.spread))]

    def explain(self) -> tuple[Explanation, ...]:
        """The most probable set of changes, the one that explains most first."""
        found = _Set(self, ())
        for _ in range(MOST_MOVES):
            better = self._best(self._additions(found)) or self._best(self._exchanges(found))
            if better is None:
                break
            found = better.settle()
        explained = [self._explanation(found, place) for place in range(len(found.parts))]
        return tuple(sorted(explained, key=lambda each: -each.gain))

    @property
    def _cost(self) -> float:
        """Log odds before the data against any one change: one of them is there, whichever."""
        return float(np.log(max(len(self.changes), 1)))

    def _additions(self, at: _Set) -> Iterator[tuple[float, _Set]]:
        """One change more, with its gain in log posterior odds."""
        for change in self.changes:
            more = at.with_change(change)
            yield more.evidence - at.evidence - self._cost, more

    def _exchanges(self, at: _Set) -> Iterator[tuple[float, _Set]]:
        """One change less, or another in its place."""
        for place in range(len(at.parts)):
            fewer = at.without(place)
            yield fewer.evidence - at.evidence + self._cost, fewer
            for change in self.changes:
                other = fewer.with_change(change)
                yield other.evidence - at.evidence, other

    @staticmethod
    def _best(moves: Iterator[tuple[float, _Set]]) -> _Set | None:
        """The best move, None where none makes the set more probable."""
        gain, found = max(moves, key=lambda each: each[0], default=(0.0, None))
        return found if gain > PROGRESS else None

    def _explanation(self, found: _Set, place: int) -> Explanation:
        """One change of a set with its uncertainty beside the others and its equivalents."""
        part, fewer = found.parts[place], found.without(place)
        slope, own = (linalg.solve_triangular(fewer.factor, each, lower=True) for each in (part.slope, part.effect))
        information = slope.T @ slope + np.diag(part.change.spread**-2.0)
        others = [change for change in self.changes if change.title != part.change.title]
        good = (each for each in others if fewer.with_change(each).evidence > found.evidence - AS_GOOD)
        return Explanation(
            change=part.change,
            values=part.values,
            covariance=np.asarray(np.linalg.inv(information), dtype=np.float64),
            effect=self.base_columns[part.change.link] @ part.change.change(part.values),
            gain=float(fewer.rest @ fewer.rest - np.sum((fewer.rest - own) ** 2)),
            log_odds=found.evidence - fewer.evidence - self._cost,
            equivalent=tuple({each.title: each for each in good}.values()),
        )


def _columns_of(base: BaseParameters, link: int, count: int) -> Array:
    """Base parameters of each standard parameter of a link, (m, 10)."""
    whole = np.zeros((10, 10 * count))
    whole[:, 10 * link : 10 * link + 10] = np.eye(10)
    return np.stack([base.project(row) for row in whole], axis=1)


def _most_probable(change: LinkChange, columns: Array, target: Array) -> Array:
    """β of the largest probability.

    Parameters
    ----------
    columns : (r, 10) float64
        what each standard parameter of the link does to the whitened surplus
    target : (r,) float64
        that surplus
    """
    if change.is_linear:
        return _ridge(columns @ change.slope(np.zeros(len(change.spread))), change.spread, target)
    start = np.zeros(len(change.spread))
    if change.is_point_mass:
        scale = np.append(change.spread[0], change.spread[0] * change.spread[1:])
        body = _ridge(columns[:, [MASS, *range(MOMENTS.start, MOMENTS.stop)]], scale, target)
        mass = body[0] if abs(body[0]) > 1e-6 * scale[0] else 1e-6 * scale[0]
        start = np.append(mass, np.clip(body[1:] / mass, -change.spread[1:], change.spread[1:]))

    def left(values: Array) -> Array:
        return np.concatenate([target - columns @ change.change(values), values / change.spread])

    def slope(values: Array) -> Array:
        return np.concatenate([-columns @ change.slope(values), np.diag(1.0 / change.spread)])

    return optimize.least_squares(left, start, slope, method="lm", x_scale=change.spread).x


def _ridge(columns: Array, spread: Array, target: Array) -> Array:
    """β of the largest probability in a linear model."""
    scaled = columns * spread
    return spread * np.linalg.solve(scaled.T @ scaled + np.eye(len(spread)), scaled.T @ target)


def explain_surplus(
    base: BaseParameters, surplus: Array, covariance: Array, links: Array | None, believed: Array
) -> Sequence[Explanation]:
    """The fewest changes of links that explain a surplus of base parameters, the largest first.

    Parameters
    ----------
    surplus : (m,) float64
        real less stated
    covariance : (m, m) float64
        of that
    links : (10 n,) float64 or None
        stated standard parameters; None where only their base parameters are known
    believed : (10 n, 10 n) float64
        covariance believed of them
    """
    return Attribution(base, surplus, whitener(covariance), links, believed).explain()


def whitener(covariance: Array) -> Array:
    """W with Wᵀ W = C⁻¹ where C says anything, (r, m).

    Parameters
    ----------
    covariance : (m, m) float64
        C
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    known = values > 1e-12 * values[-1]
    return (vectors[:, known] / np.sqrt(values[known])).T / scale
