"""The effects that are worth a closer look beside a hypothesis, each at its most probable shape."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tauscope.diagnosis.fitting.white_columns import SHAPES_AT_ONCE
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.position_noise import is_position_noise
from tauscope.diagnosis.search.scoring import SIZES, Scored, Scorer, unnamed_log_odds
from tauscope.effects import Effect, Signals, TimeLocalEffect
from tauscope.effects.computation import side_by_side
from tauscope.effects.deflection import Deflection
from tauscope.recording.recording import Array

# Effects that are looked at closer of those that explain most, and of those that explain most if nothing else can.
LOOKED_AT = 5
WORTH_A_LOOK = 2.0  # log Bayes factor on the grid below which nothing comes of a closer look
RIVALS = 0.5  # …relative to that of the effect in whose place it may be
MOST_SHAPES = 600  # shapes of a grid of thousands that are looked at first
KINDS = (0, 3)  # shape parameters of a window that are no numbers: its recordings, and its profile
EDGES = (1, 2)  # …and those that have many optima
ZOOMS = 2  # how often the neighbourhood of a shape parameter's best value is looked at
POINTS = 7  # values at once: two zooms of them are a hundredth of the grid's step


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at its most probable shape."""

    term: Term
    size: Array  # (c,), standard deviation believed of its coefficients
    # log Bayes factor of the effect beside the hypothesis, its shape and size averaged over what is believed
    log_factor: float
    unnamed: float  # log Bayes factor of torque without a name in its place
    before: Hypothesis  # the hypothesis
    found: Hypothesis  # the same with the effect, its coefficients at zero

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.term.place


@dataclass(frozen=True, eq=False)
class Looks:
    """Effects as they were seen beside hypotheses that differ at joints which they do not touch."""

    # by an effect's identity, on its grid with the discrepancy and without
    scored: dict[int, tuple[Scored, Scored]] = field(default_factory=dict)
    # those that were looked at closer; None where no such effect can be
    looked: dict[int, Proposal | None] = field(default_factory=dict)

    def forget(self, joints: Collection[int], count: int) -> None:
        """Nothing of effects that touch some joints of an arm of `count` is known any more."""
        for each, (beside, _) in list(self.scored.items()):
            if not set(joints).isdisjoint(beside.effect.touched(count)):
                del self.scored[each]
                self.looked.pop(each, None)


@dataclass(frozen=True)
class Wanted:
    """Whether an effect may be added: none a second time, but what repeats, and none that was refused."""

    present: set[Place]
    refused: Collection[Place]

    def __call__(self, effect: Effect) -> bool:
        """Whether one may."""
        place = effect.id, effect.joint
        return place not in self.refused and (effect.repeats or not self._is_present(effect))

    def _is_present(self, effect: Effect) -> bool:
        """Whether it is there at its joint, or at the whole arm: an effect of all joints and one of each are alike."""
        joints = {joint for name, joint in self.present if name == effect.id}
        return bool(joints) if effect.joint is None else bool(joints & {None, effect.joint})


class Proposer:
    """Proposes effects for the same rows."""

    def __init__(self, laboratory: Laboratory, effects: Sequence[Effect]) -> None:
        self.laboratory, self.rows, self.effects = laboratory, laboratory.rows, tuple(effects)

    def propose(
        self,
        at: Hypothesis,
        is_wanted: Callable[[Effect], bool],
        most: int = LOOKED_AT,
        instead: Place | None = None,
        looks: Looks | None = None,
    ) -> list[Proposal]:
        """Effects that make the data more probable, most first, added or `instead` of one; fills in `looks`."""
        looks = looks or Looks()
        independent = self.laboratory.under(at, [1.0] * len(at.scales), range(len(at.scales)))
        scorer = Scorer(self.rows, independent)
        signals = [at.model.signals(piece) for piece in self.rows.observations]
        wanted = [effect for effect in self.effects if is_wanted(effect) and len(effect.grid)]
        new = [effect for effect in wanted if id(effect) not in looks.scored]
        made = side_by_side(lambda effect: self._on_grid(effect, scorer, signals, independent), new)
        looks.scored.update(zip(map(id, new), made, strict=True))
        scored, found = [looks.scored[id(effect)] for effect in wanted], list[Proposal]()
        for kind in (0, 1):
            seen, lasting = set[Place](), set[Place]()
            own = (each[kind].log_evidence for each in scored if _place(each) == instead)
            least = max(RIVALS * max(own, default=0.0), WORTH_A_LOOK)
            for each in sorted(scored, key=lambda each: -each[kind].log_evidence):
                if each[kind].log_evidence < least:
                    break
                # With all forms of one effect. A window explains whatever is left, and takes no place from what lasts.
                before = seen if isinstance(each[0].effect, TimeLocalEffect) else lasting
                if len(before) < most or _place(each) in seen:
                    name = id(each[0].effect)
                    if name not in looks.looked:
                        looks.looked[name] = self._look_at(each, at, signals)
                    proposal = looks.looked[name]
                    if proposal is not None:
                        seen.add(proposal.place)
                        before.add(proposal.place)
                        found += [proposal] if proposal not in found else []
        return sorted(found, key=lambda each: -each.log_factor)

    def renew(self, proposal: Proposal, at: Hypothesis, looks: Looks) -> Proposal | None:
        """The same effect beside another hypothesis; None where it cannot be there."""
        if proposal.before is at:
            return proposal
        effect = proposal.term.effect
        signals = [at.model.signals(piece) for piece in self.rows.observations]
        return self._look_at(looks.scored[id(effect)], at, signals)

    def _on_grid(
        self, effect: Effect, scorer: Scorer, signals: Sequence[Signals], at: Hypothesis
    ) -> tuple[Scored, Scored]:
        """Every shape of an effect's grid."""
        parts = [
            scorer.score(effect, shapes, self.columns(effect, shapes, signals, at.dependence))
            for shapes in _parts(_spread_over(effect.grid))
        ]
        beside, alone = ([part[kind] for part in parts] for kind in (0, 1))
        return _join(beside), _join(alone)

    def _look_at(self, scored: tuple[Scored, Scored], at: Hypothesis, signals: Sequence[Signals]) -> Proposal | None:
        """An effect with scales of its own, at its most probable shape; None where no such effect can be."""
        beside, alone = scored
        on_grid = beside if np.isfinite(beside.log_factors.max()) else alone
        if not np.isfinite(on_grid.log_factors.max()):
            return None
        effect, place = on_grid.effect, on_grid.best
        joints = effect.touched(len(at.scales))
        is_open = any(effect.is_free(each) for each in range(len(effect.shapes)))
        shape, size = on_grid.shapes[place], on_grid.sizes[place]
        if is_open:
            shape, size = self._zoom_in_each_form(on_grid, at, signals)
        found = self._extend(effect, shape, size, at)
        if is_open:
            beside = self.laboratory.paint(at, found)
            shape, size = self.zoom(effect, shape, size, beside, signals)
            found = self._extend(effect, shape, size, beside, anew=False)
        term = found.model.terms[-1]
        own = found.posterior.mean[found.model.term_places()[-1]]
        term = replace(term, coefficients=own[: len(size)])
        k_v = None if effect.joint is None else at.model.structure.terms[effect.joint].k_v
        if not term.is_possible(k_v):
            return None
        rows = self.rows.observations
        if isinstance(effect, Deflection) and is_position_noise(effect, shape, at.model, rows, signals):
            return None
        one_sided = sum(each.positive for each in effect.coefficients)
        # Where the effect is there, only the model that has it tells the noise.
        averaged = on_grid.log_evidence - float(on_grid.log_factors.max())
        sized = float(np.log(2.0)) * one_sided - float(np.log(len(SIZES)))
        before = self.laboratory.tune(self.laboratory.under(at, found.dependence, joints), joints)
        factor = found.log_evidence - before.log_evidence + averaged + sized
        return Proposal(term, size, factor, unnamed_log_odds(at), at, found)

    def _zoom_in_each_form(self, on_grid: Scored, at: Hypothesis, signals: Sequence[Signals]) -> tuple[Array, Array]:
        """The most probable shape of all values that no step changes: each has an optimum of its own."""
        effect, scorer = on_grid.effect, Scorer(self.rows, at)
        found = []
        for place in on_grid.best_of_each_form():
            shape, size = self.zoom(effect, on_grid.shapes[place], on_grid.sizes[place], at, signals)
            columns = self.columns(effect, shape[None], signals, at.dependence)
            found.append((float(scorer.score(effect, shape[None], columns)[0].log_factors[0]), shape, size))
        return max(found, key=lambda each: each[0])[1:]

    def _extend(self, effect: Effect, shape: Array, size: Array, at: Hypothesis, *, anew: bool = True) -> Hypothesis:
        """A hypothesis with an effect of a given shape, under scales of highest evidence.

        These are looked for as if rows were independent: under the noise and the dependence of a hypothesis that lacks
        the effect, it would stay smaller than it is, and leave both as they are.
        """
        joints = effect.touched(len(at.scales))
        added = self.laboratory.with_term(at, Term(effect, shape, np.zeros(len(size))), size)
        added = self.laboratory.under(added, [1.0] * len(at.scales), joints)
        return self.laboratory.weigh(self.laboratory.tune(added, joints, anew=anew), joints)

    def zoom(
        self, effect: Effect, shape: Array, size: Array, at: Hypothesis, signals: Sequence[Signals]
    ) -> tuple[Array, Array]:
        """The best `shape`, (k,), with its `size`, (c,), parameter by parameter, between the grid's neighbours."""
        scorer = Scorer(self.rows, at)

        def choose(values: Array, place: int) -> int | None:
            """Which of some values of a parameter is the most probable, the last being the one at hand."""
            nonlocal shape, size
            shapes = np.tile(shape, (len(values) + 1, 1))
            shapes[:-1, place] = values
            found, _ = scorer.score(effect, shapes, self.columns(effect, shapes, signals, at.dependence))
            if not np.isfinite(found.log_factors.max()):
                return None
            shape, size = found.shapes[found.best], found.sizes[found.best]
            return found.best

        if isinstance(effect, TimeLocalEffect):
            for place in KINDS:
                choose(np.unique(effect.grid[:, place]), place)
            for place in EDGES:  # optima lie as close as the rows
                choose(np.arange(*neighbours(effect, shape, place), self.rows.interval_s), place)
            return shape, size
        for place in (place for place in range(len(effect.shapes)) if effect.is_free(place)):
            low, high = neighbours(effect, shape, place)
            for _ in range(ZOOMS):
                values = spread(low, high, effect.shapes[place].logarithmic)
                best = choose(values, place)
                if best is None:
                    break
                if best < POINTS:
                    low, high = float(values[max(best - 1, 0)]), float(values[min(best + 1, POINTS - 1)])
        return shape, size

    def columns(
        self, effect: Effect, shapes: Array, signals: Sequence[Signals], dependence: Sequence[float]
    ) -> dict[int, Array]:
        """White rows of an effect of `shapes`, (s, k), at every joint that it touches, (s, c, R_j)."""
        white = self.rows.columns(effect, shapes, signals)
        return {joint: self.rows.take(joint, rows, dependence[joint]) for joint, rows in white.items()}


def _spread_over(grid: Array) -> Array:
    """Some of the shapes of a large grid; no fixed step, which would leave out all that alternate."""
    return grid[np.unique(np.linspace(0, len(grid) - 1, min(len(grid), MOST_SHAPES)).round().astype(int))]


def _parts(shapes: Array) -> Iterator[Array]:
    """Shapes a few at a time."""
    for first in range(0, len(shapes), SHAPES_AT_ONCE):
        yield shapes[first : first + SHAPES_AT_ONCE]


def _join(parts: Sequence[Scored]) -> Scored:
    """All shapes of one effect."""
    names = ("shapes", "log_factors", "coefficients", "sizes")
    return Scored(parts[0].effect, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _place(scored: tuple[Scored, Scored]) -> Place:
    """Which effect where."""
    effect = scored[0].effect
    return effect.id, effect.joint


def neighbours(effect: Effect, shape: Array, place: int) -> tuple[float, float]:
    """The grid's values below and above the one at a place of `shape`, (k,), or its bounds."""
    values = np.unique(effect.grid[:, place])
    at = int(np.argmin(np.abs(values - shape[place])))
    low = values[at - 1] if at > 0 else effect.lower[place]
    high = values[at + 1] if at + 1 < len(values) else effect.upper[place]
    return float(low), float(high)


def spread(low: float, high: float, logarithmic: bool) -> Array:
    """`POINTS` values of a shape parameter, the ends among them, (p,)."""
    return np.geomspace(low, high, POINTS) if logarithmic else np.linspace(low, high, POINTS)
