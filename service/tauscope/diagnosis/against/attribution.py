"""The fewest wrong numbers of links that explain how base parameters differ from stated ones.

With d the surplus of the base parameters, C its covariance and x_g(β_g) the changes of some links' standard parameters,

    d = B Σ_g x_g(β_g) + e,   e ~ N(0, s² C),   β_g ~ N(0, s² V_g),   s ≥ 1,

B the base parameters of each standard one. A set of changes is as good as the probability of d under it, β integrated
out: every number that may change costs what it could have been otherwise, so that one mass is preferred to ten moments
(MacKay 1992). The most probable s is what a model that is wrong elsewhere adds to the errors. A change is added,
exchanged or left out until nothing helps.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, optimize, stats

from tauscope.diagnosis.against.link_changes import MASS, MOMENTS, LinkChange, link_changes
from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.effects.carried_body import FARTHEST_M
from tauscope.recording.recording import Array

AS_GOOD = 3.0  # log odds within which another change is an equivalent explanation: one in twenty
PROGRESS = 1e-3  # gain in log probability from which an exchange is one
UNLIKELY = 1e-3  # chance of what is left, below which more may be wrong than steps of one change find
MOST_OF_IT = 0.7  # part of what makes the surplus significant that a body at the tool takes at least
MOST_MOVES = 100  # additions and exchanges, at most


@dataclass(frozen=True, eq=False)
class Explanation:
    """One change of a link with its most probable values."""

    change: LinkChange
    values: Array  # (k,), β
    covariance: Array  # (k, k), of β, beside all other changes
    effect: Array  # (m,), what it changes of the base parameters
    gain: float  # what it takes off the surplus [variances]
    log_odds: float  # posterior, that it is there
    equivalent: tuple[LinkChange, ...]  # changes that explain as much in its place


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
    def inflation(self) -> float:
        """s²: what is left over what C leads to expect, at least 1."""
        return max(float(self.rest @ self.rest) / len(self.rest), 1.0)

    @cached_property
    def evidence(self) -> float:
        """Log probability of the surplus, but for a constant."""
        known = -float(np.log(np.diag(self.factor)).sum()) - 0.5 * len(self.rest) * np.log(self.inflation)
        return known - 0.5 * float(self.rest @ self.rest) / self.inflation

    def without(self, place: int) -> "_Set":
        """The same less one change."""
        return _Set(self.problem, (*self.parts[:place], *self.parts[place + 1 :]))

    @property
    def is_possible(self) -> bool:
        """Whether no link is told a mass that is not positive."""
        return all(part.change.is_possible(part.values) for part in self.parts)

    def with_change(self, change: LinkChange) -> "_Set":
        """The same with one more change at its most probable values."""
        return _Set(self.problem, (*self.parts, self._fit(change)))

    def _fit(self, change: LinkChange) -> _Part:
        """A change at its most probable values beside the others."""
        seen = linalg.solve_triangular(self.factor, self.problem.columns[change.link], lower=True)
        return self.problem.part(change, _most_probable(change, seen, self.rest))

    def settle(self) -> "_Set":
        """The same at the most probable values of all changes together."""
        changes = [part.change for part in self.parts]
        if all(change.is_linear for change in changes) or len(changes) < 2:
            return self
        ends = np.cumsum([len(change.spread) for change in changes])[:-1]
        spread = np.concatenate([change.spread for change in changes])
        columns = [self.problem.columns[change.link] for change in changes]

        def left(values: Array) -> Array:
            pairs = zip(columns, changes, np.split(values, ends), strict=True)
            explained = sum(own @ change.change(each) for own, change, each in pairs)
            return np.concatenate([self.problem.target - explained, values / spread])

        def slope(values: Array) -> Array:
            pairs = zip(columns, changes, np.split(values, ends), strict=True)
            slopes = np.concatenate([-own @ change.slope(each) for own, change, each in pairs], axis=1)
            return np.concatenate([slopes, np.diag(1.0 / spread)])

        start = np.concatenate([part.values for part in self.parts])
        found = optimize.least_squares(left, start, slope, method="lm", x_scale=spread).x
        pairs = zip(changes, np.split(found, ends), strict=True)
        return _Set(self.problem, tuple(self.problem.part(change, values) for change, values in pairs))


class Attribution:
    """A surplus of base parameters that is to be explained by links.

    `base`: of the arm; `surplus`: (m,), real less stated base parameters; `covariance`: (m, m), C; `links`: (10 n,),
    stated standard parameters; None where only their base parameters are known; `believed`: (10 n, 10 n), covariance
    believed of them.
    """

    def __init__(
        self, base: BaseParameters, surplus: Array, covariance: Array, links: Array | None, believed: Array
    ) -> None:
        count, whitener = len(believed) // 10, _whitener(covariance)
        self.target = whitener @ surplus
        self.base_columns = [_columns_of(base, link, count) for link in range(count)]
        self.columns = [whitener @ columns for columns in self.base_columns]
        self.changes: list[LinkChange] = []
        for link, columns in enumerate(self.columns):
            own = slice(10 * link, 10 * link + 10)
            stated = None if links is None else links[own]
            found = link_changes(link, stated, believed[own, own])
            self.changes += [each for each in found if np.any(columns @ each.slope(each.spread))]

    def payload(self) -> LinkChange | None:
        """A body at the tool that accounts for most of the surplus, where no change of few numbers is as probable."""
        none, last = _Set(self, ()), len(self.columns) - 1
        for change in self.changes:
            if not change.is_point_mass or change.link != last:
                continue
            alone = none.with_change(change)
            (mass, *place), energy = alone.parts[0].values, float(self.target @ self.target)
            left = float(np.sum((self.target - alone.parts[0].effect) ** 2))
            if mass <= 0.0 or np.linalg.norm(place) > FARTHEST_M or self._log_odds(alone) <= self._log_odds(none):
                return None
            simpler = (each for each in self.changes if len(each.quantities) < len(change.quantities))
            most = energy - left >= MOST_OF_IT * (energy - len(self.target))
            return (
                change if most and all(none.with_change(each).evidence < alone.evidence for each in simpler) else None
            )
        return None

    def explain(self, first: LinkChange | None = None) -> tuple[Explanation, ...]:
        """The most probable set of changes, the largest first; `first` is one of them in any case, and the first."""
        start = _Set(self, ())
        start = start if first is None else start.with_change(first)
        kept = len(start.parts)
        found = self._search(start, kept)
        if stats.chi2.sf(float(found.rest @ found.rest), len(self.target)) < UNLIKELY:
            for change in self.changes:
                start = start.with_change(change) if change.is_whole else start
            found = max(found, self._simplify(start.settle(), kept), key=self._log_odds)
        explained = [self._explanation(found, place) for place in range(len(found.parts))]
        return (*explained[:kept], *sorted(explained[kept:], key=lambda each: -each.gain))

    @property
    def _cost(self) -> float:
        """Log odds before the data against any one change: one of them is there, whichever."""
        return float(np.log(max(len(self.changes), 1)))

    def _simplify(self, found: _Set, kept: int) -> _Set:
        """The same with fewer numbers a link, from the tip inwards: an inner link takes what outer ones leave."""
        for drop in (False, True):  # a link left out too early leaves its share to the others
            before = -np.inf
            while self._log_odds(found) > before:
                before = self._log_odds(found)
                for link in sorted({part.change.link for part in found.parts[kept:]}, reverse=True):
                    found = self._better(found, self._simpler(found, link, kept, drop=drop)) or found
        return found

    def _simpler(self, found: _Set, link: int, kept: int, *, drop: bool) -> Iterator[_Set]:
        """Another change of the same link, or none."""
        place = next(place for place, part in enumerate(found.parts) if part.change.link == link and place >= kept)
        fewer = found.without(place)
        if drop:
            yield fewer
        yield from (fewer.with_change(change) for change in self.changes if change.link == link)

    def _search(self, found: _Set, kept: int) -> _Set:
        """The most probable set that steps of one change lead to; the first ones stay."""
        for _ in range(MOST_MOVES):
            better = self._better(found, self._additions(found)) or self._better(found, self._exchanges(found, kept))
            if better is None:
                break
            found = better
        return found

    def part(self, change: LinkChange, values: Array) -> _Part:
        """A change at its values. `values`: (k,), β."""
        columns = self.columns[change.link]
        return _Part(change, values, columns @ change.change(values), columns @ change.slope(values))

    def _log_odds(self, found: _Set) -> float:
        return found.evidence - self._cost * len(found.parts)

    def _additions(self, at: _Set) -> Iterator[_Set]:
        """One change more."""
        return (at.with_change(change) for change in self.changes)

    def _exchanges(self, at: _Set, kept: int) -> Iterator[_Set]:
        """One change less, or another in its place, but for the first ones."""
        for place in range(kept, len(at.parts)):
            fewer = at.without(place)
            yield fewer
            yield from self._additions(fewer)

    def _better(self, at: _Set, moves: Iterator[_Set]) -> _Set | None:
        """The first of the best moves that makes the set more probable also when all its values are fitted."""
        least = self._log_odds(at) + PROGRESS
        likely = sorted(moves, key=lambda each: -self._log_odds(each))
        settled = (each.settle() for each in likely if self._log_odds(each) > least)
        return next((each for each in settled if each.is_possible and self._log_odds(each) > least), None)

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
            covariance=np.asarray(np.linalg.inv(information), dtype=np.float64) * found.inflation,
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
    """β of the largest probability, of `columns`, (r, 10), of the link's parameters to a whitened surplus, (r,)."""
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


def _whitener(covariance: Array) -> Array:
    """W with Wᵀ W = C⁻¹ where C says anything, (r, m)."""
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    known = values > 1e-12 * values[-1]
    return (vectors[:, known] / np.sqrt(values[known])).T / scale
