"""The effects that are worth a closer look beside a hypothesis, each at its most probable shape."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.evidence.linear_model import LinearModel
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.diagnosis.search.scoring import SIZES, Scored, Scorer
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import side_by_side
from tauscope.recording.recording import Array

Place = tuple[str, int | None]
"""Effect id and joint index, from 0; None for the whole arm."""

LOOKED_AT = 5
"""Effects that are looked at closer of those that explain most, and of those that explain most if nothing else can."""

WORTH_A_LOOK = 2.0
"""Log Bayes factor on the grid below which nothing comes of a closer look."""

SHAPES_AT_ONCE = 48
"""Shapes whose columns are made together: bounds memory."""

MOST_SHAPES = 200
"""Shapes of a grid of thousands that are looked at first."""

POINTS, ZOOMS = 7, 2
"""Values of one shape parameter that are compared at once, and how often the best one's neighbourhood is."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at its most probable shape.

    log_factor : float
        log Bayes factor of the effect beside the hypothesis, its shape and size averaged over what is believed
    log_factor_alone : float
        the same on the grid if nothing without a name were left out
    size : (c,) float64
        standard deviation believed of its coefficients
    scales : tuple of Scales
        of highest evidence with it
    """

    term: Term
    size: Array
    log_factor: float
    log_factor_alone: float
    scales: tuple[Scales, ...]

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.term.effect.id, self.term.effect.joint


class Proposer:
    """Proposes effects for the same rows; columns that no model changes are made once."""

    def __init__(self, rows: EvidenceRows, effects: Sequence[Effect]) -> None:
        self.rows, self.effects = rows, tuple(effects)

    def propose(self, at: Hypothesis, is_wanted: Callable[[Effect], bool]) -> list[Proposal]:
        """Effects that make the data more probable, the most probable first."""
        scorer = Scorer(self.rows, at)
        signals = [at.model.signals(piece) for piece in self.rows.observations]
        wanted = [effect for effect in self.effects if is_wanted(effect) and len(effect.grid)]
        scored = side_by_side(lambda effect: self._on_grid(effect, scorer, signals), wanted)
        chosen = _shortlist([pair[0] for pair in scored]) | _shortlist([pair[1] for pair in scored])
        pairs = [scored[place] for place in sorted(chosen)]
        found = [self._looked_at(pair, scorer, at, signals) for pair in pairs]
        best: dict[Place, Proposal] = {}
        for proposal in sorted((each for each in found if each is not None), key=lambda each: -each.log_factor):
            best.setdefault(proposal.place, proposal)
        return list(best.values())

    def _on_grid(self, effect: Effect, scorer: Scorer, signals: Sequence[Signals]) -> tuple[Scored, Scored]:
        """Every shape of an effect's grid."""
        parts = [
            scorer.scored(effect, shapes, self.columns(effect, shapes, signals))
            for shapes in _parts(_thinned(effect.grid))
        ]
        beside, alone = ([part[kind] for part in parts] for kind in (0, 1))
        return _joined(beside), _joined(alone)

    def _looked_at(
        self, scored: tuple[Scored, Scored], scorer: Scorer, at: Hypothesis, signals: Sequence[Signals]
    ) -> Proposal | None:
        """An effect with scales of its own, at its most probable shape; None where no such effect can be."""
        beside, alone = scored
        on_grid = beside if np.isfinite(beside.log_factors.max()) else alone
        if not np.isfinite(on_grid.log_factors.max()):
            return None
        effect, place = on_grid.effect, on_grid.best
        joints = effect.touched(len(at.scales))
        shape, size = self._zoomed(effect, on_grid.shapes[place], on_grid.sizes[place], at, signals)
        scales, gained = self._tuned(effect, shape, size, at, joints, signals)
        if effect.shapes and any(effect.is_free(each) for each in range(len(effect.shapes))):
            shape, size = self._zoomed(effect, shape, size, replace(at, scales=scales), signals)
            scales, gained = self._tuned(effect, shape, size, replace(at, scales=scales), joints, signals)
        linear = self._extended(effect, shape, size, at.linear, signals)
        coefficients = linear.posterior(scales).mean[at.linear.size :]
        if not _is_possible(effect, coefficients, shape, at.model):
            return None
        one_sided = sum(each.positive for each in effect.coefficients)
        averaged = on_grid.log_evidence - float(on_grid.log_factors.max())
        sized = float(np.log(2.0)) * one_sided - float(np.log(len(SIZES)))
        factor = gained - at.log_evidence + averaged + sized
        return Proposal(Term(effect, shape, coefficients), size, factor, alone.log_evidence, scales)

    def _tuned(
        self,
        effect: Effect,
        shape: Array,
        size: Array,
        at: Hypothesis,
        joints: Sequence[int],
        signals: Sequence[Signals],
    ) -> tuple[tuple[Scales, ...], float]:
        """Scales of highest evidence with an effect, and that log evidence."""
        linear = self._extended(effect, shape, size, at.linear, signals)
        scales = linear.most_probable(at.scales, joints)
        return scales, linear.evidence(scales)

    def _extended(
        self, effect: Effect, shape: Array, size: Array, linear: LinearModel, signals: Sequence[Signals]
    ) -> LinearModel:
        columns = self.columns(effect, shape[None], signals)
        return linear.extended({joint: own[0] for joint, own in columns.items()}, np.zeros(len(size)), size)

    def _zoomed(
        self, effect: Effect, shape: Array, size: Array, at: Hypothesis, signals: Sequence[Signals]
    ) -> tuple[Array, Array]:
        """One free shape parameter after the other between its neighbours on the grid."""
        free = [place for place in range(len(effect.shapes)) if effect.is_free(place)]
        if not free:
            return shape, size
        scorer = Scorer(self.rows, at)
        for place in free:
            low, high = _neighbours(effect, shape, place)
            for _ in range(ZOOMS):
                logarithmic = effect.shapes[place].logarithmic
                values = np.geomspace(low, high, POINTS) if logarithmic else np.linspace(low, high, POINTS)
                shapes = np.tile(shape, (POINTS + 1, 1))
                shapes[:POINTS, place] = values
                found, _ = scorer.scored(effect, shapes, self.columns(effect, shapes, signals))
                if not np.isfinite(found.log_factors.max()):
                    break
                best = found.best
                shape, size = found.shapes[best], found.sizes[best]
                if best < POINTS:
                    low, high = float(values[max(best - 1, 0)]), float(values[min(best + 1, POINTS - 1)])
        return shape, size

    def columns(self, effect: Effect, shapes: Array, signals: Sequence[Signals]) -> dict[int, Array]:
        """White rows of an effect at every joint that it touches, (s, c, R_j).

        Parameters
        ----------
        shapes : (s, k) float64
            values of its shape parameters
        """
        observations = self.rows.observations
        touched = effect.touched(observations.robot.joint_count)
        pieces: dict[int, list[Array]] = {joint: [] for joint in touched}
        width = len(effect.coefficients)
        for piece, own in zip(observations, signals, strict=True):
            columns = effect.columns(own, shapes)
            for slot, joint in enumerate(touched):
                values = columns[:, :, slot]
                flat = np.ascontiguousarray(values.reshape(len(shapes) * width, *values.shape[2:]))
                pieces[joint].append(piece.reduced(flat))
        return {
            joint: self.rows.take(joint, observations.white(joint, rows)).reshape(len(shapes), width, -1)
            for joint, rows in pieces.items()
        }


def _parts(shapes: Array) -> Iterator[Array]:
    """Shapes a few at a time."""
    for first in range(0, len(shapes), SHAPES_AT_ONCE):
        yield shapes[first : first + SHAPES_AT_ONCE]


def _thinned(grid: Array) -> Array:
    """At most `MOST_SHAPES` shapes of a grid, evenly: of many windows in time neighbours overlap."""
    return grid[:: max(1, len(grid) // MOST_SHAPES)] if len(grid) > 2 * MOST_SHAPES else grid


def _joined(parts: Sequence[Scored]) -> Scored:
    """All shapes of one effect."""
    names = ("shapes", "log_factors", "coefficients", "sizes")
    return Scored(parts[0].effect, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _shortlist(scored: Sequence[Scored]) -> set[int]:
    """Places of the best forms of the effects that explain most, one form an effect and joint."""
    ranked = sorted(range(len(scored)), key=lambda place: -scored[place].log_evidence)
    chosen: dict[Place, int] = {}
    for place in ranked:
        if len(chosen) == LOOKED_AT or scored[place].log_evidence < WORTH_A_LOOK:
            break
        effect = scored[place].effect
        chosen.setdefault((effect.id, effect.joint), place)
    return set(chosen.values())


def _is_possible(effect: Effect, coefficients: Array, shape: Array, model: ExtendedModel) -> bool:
    """Whether an effect can have these values."""
    signs = zip(effect.coefficients, coefficients, strict=True)
    if not all(
        each.smallest <= abs(value) <= each.largest and (value >= 0.0 or not each.positive) for each, value in signs
    ):
        return False
    k_v = None if effect.joint is None else model.structure.terms[effect.joint].k_v
    return effect.is_possible(shape, k_v) and effect.is_consistent(coefficients, shape)


def _neighbours(effect: Effect, shape: Array, place: int) -> tuple[float, float]:
    """The grid's values of a shape parameter below and above, or its bounds."""
    values = np.unique(effect.grid[:, place])
    at = int(np.argmin(np.abs(values - shape[place])))
    low = values[at - 1] if at > 0 else effect.lower[place]
    high = values[at + 1] if at + 1 < len(values) else effect.upper[place]
    return float(low), float(high)
