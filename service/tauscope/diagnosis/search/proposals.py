"""The effects that are worth a closer look beside a hypothesis, each at its most probable shape."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.evidence.linear_model import LinearModel
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.refinement import POINTS, neighbours, spread
from tauscope.diagnosis.screening.screen import SHAPES_AT_ONCE, white_columns
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.diagnosis.search.scoring import SIZES, Scored, Scorer
from tauscope.diagnosis.selection.choice import Place, has_possible_values
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import side_by_side
from tauscope.identification.excitation import thin
from tauscope.recording.recording import Array

LOOKED_AT = 5
"""Effects that are looked at closer of those that explain most, and of those that explain most if nothing else can."""

WORTH_A_LOOK = 2.0
"""Log Bayes factor on the grid below which nothing comes of a closer look."""

MOST_SHAPES = 200
"""Shapes of a grid of thousands that are looked at first."""

ZOOMS = 2
"""How often the neighbourhood of a shape parameter's best value is looked at."""


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
    """Proposes effects for the same rows."""

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
        found = [self._look_at(pair, scorer, at, signals) for pair in pairs]
        best: dict[Place, Proposal] = {}
        for proposal in sorted((each for each in found if each is not None), key=lambda each: -each.log_factor):
            best.setdefault(proposal.place, proposal)
        return list(best.values())

    def _on_grid(self, effect: Effect, scorer: Scorer, signals: Sequence[Signals]) -> tuple[Scored, Scored]:
        """Every shape of an effect's grid."""
        parts = [
            scorer.score(effect, shapes, self.columns(effect, shapes, signals))
            for shapes in _parts(thin(effect.grid, MOST_SHAPES))
        ]
        beside, alone = ([part[kind] for part in parts] for kind in (0, 1))
        return _join(beside), _join(alone)

    def _look_at(
        self, scored: tuple[Scored, Scored], scorer: Scorer, at: Hypothesis, signals: Sequence[Signals]
    ) -> Proposal | None:
        """An effect with scales of its own, at its most probable shape; None where no such effect can be."""
        beside, alone = scored
        on_grid = beside if np.isfinite(beside.log_factors.max()) else alone
        if not np.isfinite(on_grid.log_factors.max()):
            return None
        effect, place = on_grid.effect, on_grid.best
        joints = effect.touched(len(at.scales))
        shape, size = self._zoom(effect, on_grid.shapes[place], on_grid.sizes[place], at, signals)
        scales, gained = self._tune(effect, shape, size, at, joints, signals)
        if any(effect.is_free(each) for each in range(len(effect.shapes))):
            shape, size = self._zoom(effect, shape, size, replace(at, scales=scales), signals)
            scales, gained = self._tune(effect, shape, size, replace(at, scales=scales), joints, signals)
        linear = self._extend(effect, shape, size, at.linear, signals)
        coefficients = linear.posterior(scales).mean[at.linear.size :]
        k_v = None if effect.joint is None else at.model.structure.terms[effect.joint].k_v
        term = Term(effect, shape, coefficients)
        if not (has_possible_values(term, k_v) and effect.is_consistent(coefficients, shape)):
            return None
        one_sided = sum(each.positive for each in effect.coefficients)
        averaged = on_grid.log_evidence - float(on_grid.log_factors.max())
        sized = float(np.log(2.0)) * one_sided - float(np.log(len(SIZES)))
        factor = gained - at.log_evidence + averaged + sized
        return Proposal(term, size, factor, alone.log_evidence, scales)

    def _tune(
        self,
        effect: Effect,
        shape: Array,
        size: Array,
        at: Hypothesis,
        joints: Sequence[int],
        signals: Sequence[Signals],
    ) -> tuple[tuple[Scales, ...], float]:
        """Scales of highest evidence with an effect, and that log evidence."""
        linear = self._extend(effect, shape, size, at.linear, signals)
        scales = linear.most_probable(at.scales, joints)
        return scales, linear.evidence(scales)

    def _extend(
        self, effect: Effect, shape: Array, size: Array, linear: LinearModel, signals: Sequence[Signals]
    ) -> LinearModel:
        columns = self.columns(effect, shape[None], signals)
        return linear.extend({joint: own[0] for joint, own in columns.items()}, np.zeros(len(size)), size)

    def _zoom(
        self, effect: Effect, shape: Array, size: Array, at: Hypothesis, signals: Sequence[Signals]
    ) -> tuple[Array, Array]:
        """One free shape parameter after the other between its neighbours on the grid."""
        free = [place for place in range(len(effect.shapes)) if effect.is_free(place)]
        if not free:
            return shape, size
        scorer = Scorer(self.rows, at)
        for place in free:
            low, high = neighbours(effect, shape, place)
            for _ in range(ZOOMS):
                values = spread(low, high, effect.shapes[place].logarithmic)
                shapes = np.tile(shape, (POINTS + 1, 1))
                shapes[:POINTS, place] = values
                found, _ = scorer.score(effect, shapes, self.columns(effect, shapes, signals))
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
        white = white_columns(self.rows.observations, effect, shapes, signals)
        return {joint: self.rows.take(joint, rows) for joint, rows in white.items()}


def _parts(shapes: Array) -> Iterator[Array]:
    """Shapes a few at a time."""
    for first in range(0, len(shapes), SHAPES_AT_ONCE):
        yield shapes[first : first + SHAPES_AT_ONCE]


def _join(parts: Sequence[Scored]) -> Scored:
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
