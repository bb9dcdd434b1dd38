"""Every form of every effect beside the fitted model: how much each would explain, and how likely noise does that."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import INVISIBLE, Moments, moments, statistics
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.effective_number import effective_number
from tauscope.diagnosis.screening.windows import Windows, white_torque, windowed_moments, windows_on_rows, windows_tried
from tauscope.effects import Effect, Signals, TimeLocalEffect
from tauscope.effects.computation import side_by_side
from tauscope.recording.recording import Array

MOST_KEPT = 400 * 1024 * 1024
"""Bytes of columns that are kept from one model to the next."""

WORTH_COUNTING = 1e-3
"""Chance below which the best of many windows is worth the draws that tell how many windows there are in effect; above,
all of them count, which changes no decision."""

MOST_TOLD = 400
"""Shapes of which it is told how many count in effect; more count one by one, which is never too bold."""

SHAPES_AT_ONCE = 48
"""Shapes whose columns are made together: bounds memory."""

SAME_LOAD = 0.02
"""Part of a joint's load, rms, by which it may differ between two models that share the columns it shapes: what those
explain errs by as much, far less than between two shapes of a grid. Whoever refines or fits a form makes its own."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One form of an effect beside a fitted model, at its best shape.

    shape : (k,) float64
        the best shape
    coefficients : (c,) float64
        with which it explains most
    gain : float
        T, what it takes off the residual's energy [noise variances]
    gram : (c, c) float64
        of its projected columns at that shape
    """

    effect: Effect
    shape: Array
    coefficients: Array
    gain: float
    gram: Array
    visible: bool
    shapes_tried: float
    information: float

    @property
    def count(self) -> int:
        """Number of coefficients c."""
        return len(self.coefficients)

    @property
    def score(self) -> float:
        """T less what as many coefficients and shapes would explain of noise."""
        return self.gain - self.count - 2.0 * float(np.log(self.shapes_tried))

    def p_value(self, inflation: float = 1.0, *, refined: bool = False, freedom: float = np.inf) -> float:
        """Chance that noise alone explains as much somewhere on this form's grid."""
        free = sum(self.effect.is_free(place) for place in range(len(self.shape))) if refined else 0
        count = self.count + free
        share = max(self.gain, 0.0) / inflation
        tail = float(chdtrc(count, share) if np.isinf(freedom) else fdtrc(count, freedom, share / count))
        return min(1.0, self.shapes_tried * tail * (1.0 if free else self._one_sided))

    @property
    def _one_sided(self) -> float:
        return 0.5 if self.count == 1 and self.effect.coefficients[0].positive else 1.0


@dataclass(frozen=True, eq=False)
class _Kept:
    """Whitened columns of some shapes of a grid.

    columns : dict of int to (g, c, R_j) float64
        at every joint that the effect touches
    loads : list of (N,) float64
        of the effect's joint in every piece, where they shape the columns
    """

    columns: dict[int, Array]
    loads: list[Array]

    @property
    def size(self) -> int:
        """Bytes."""
        return sum(rows.nbytes for rows in self.columns.values())

    def serves(self, loads: Sequence[Array]) -> bool:
        """Whether columns beside other loads would be nearly the same."""
        differ = sum(float((new - old) @ (new - old)) for new, old in zip(loads, self.loads, strict=True))
        return differ <= SAME_LOAD**2 * sum(float(old @ old) for old in self.loads)


class Screen:
    """Screens effects on the same observations; effective numbers of shapes are worked out once."""

    def __init__(
        self, observations: Observations, effects: Sequence[Effect], seed: int = 0, *, count_all: bool = False
    ) -> None:
        self.observations = observations
        self.effects = tuple(effects)
        self._seed = seed
        self._count_all = count_all
        self._kept: dict[tuple[int, int], _Kept] = {}
        self._numbers: dict[int, float] = {}
        self._windows: dict[int, Windows] = {}
        self._found: dict[Fit, dict[int, Candidate]] = {}

    def candidates(self, fit: Fit, wanted: Callable[[Effect], bool] = lambda effect: True) -> list[Candidate]:
        """Every form that is wanted at its best shape on the grid."""
        places = [at for at, effect in enumerate(self.effects) if wanted(effect)]
        if fit not in self._found:
            if len(self._found) > 1:
                self._found.popitem()  # the last model's; those of the nominal one, the first, are asked for again
            self._found[fit] = {}
        known = self._found[fit]
        new = [at for at in places if at not in known]
        known.update(zip(new, self._screened(fit, new), strict=True))
        return [known[at] for at in places]

    def _screened(self, fit: Fit, places: Sequence[int]) -> list[Candidate]:
        """Some of the forms, by their places among all."""
        signals = [fit.model.signals(piece) for piece in self.observations]
        return side_by_side(lambda at: self._candidate(at, self.effects[at], fit, signals), places)

    def at_shapes(self, effect: Effect, shapes: Array, fit: Fit, signals: Sequence[Signals]) -> Moments:
        """Moments of an effect at any shapes.

        Parameters
        ----------
        shapes : (g, k) float64
            shapes
        """
        return moments(fit.projection, self.white_columns(effect, shapes, signals))

    def white_columns(self, effect: Effect, shapes: Array, signals: Sequence[Signals]) -> dict[int, Array]:
        """`white_columns` of these observations.

        Parameters
        ----------
        shapes : (g, k) float64
            shapes
        """
        return white_columns(self.observations, effect, shapes, signals)

    def _candidate(self, place: int, effect: Effect, fit: Fit, signals: Sequence[Signals]) -> Candidate:
        if isinstance(effect, TimeLocalEffect):
            found = self._through_windows(place, effect, fit, signals)
        else:
            found = self._on_grid(place, effect, fit, signals)
        gains, coefficients = statistics(found, [each.positive for each in effect.coefficients])
        worth = np.where(effect.preferable(coefficients, effect.grid), gains - effect.reluctance(effect.grid), -np.inf)
        best = int(np.argmax(worth))
        visible = (found.shares > INVISIBLE).all(axis=1)
        return Candidate(
            effect=effect,
            shape=effect.grid[best],
            coefficients=coefficients[best],
            gain=float(gains[best]),
            gram=found.gram[best],
            visible=bool(visible.any()),
            shapes_tried=self._numbers.get(place, float(len(effect.grid))),
            information=float(np.median(found.gram[visible, 0, 0])) if visible.any() else 0.0,
        )

    def _on_grid(self, place: int, effect: Effect, fit: Fit, signals: Sequence[Signals]) -> Moments:
        """Moments of all shapes of the grid."""
        parts, whitened = [], []
        known = place in self._numbers
        for first in range(0, len(effect.grid), SHAPES_AT_ONCE):
            columns = self._grid_columns(place, first, effect, signals)
            parts.append(moments(fit.projection, columns))
            if not known and 1 < len(effect.grid) <= MOST_TOLD:
                whitened.append(columns)
        found = Moments(*(np.concatenate([getattr(part, name) for part in parts]) for name in Moments.__annotations__))
        if not known:
            told = effective_number(found, whitened, self._draws(place)) if whitened else float(len(effect.grid))
            self._numbers[place] = told
        return found

    def _grid_columns(self, place: int, first: int, effect: Effect, signals: Sequence[Signals]) -> dict[int, Array]:
        """Whitened columns of some of the grid's shapes; those that no model changes by much are kept."""
        loads = [own.load[effect.joint or 0] for own in signals] if effect.of_motion_and_load else []
        kept = self._kept.pop((place, first), None)
        if kept is None or not kept.serves(loads):
            kept = _Kept(self.white_columns(effect, effect.grid[first : first + SHAPES_AT_ONCE], signals), loads)
        if effect.of_motion_alone or effect.of_motion_and_load:
            self._keep((place, first), kept)
        return kept.columns

    def _keep(self, place: tuple[int, int], found: _Kept) -> None:
        """Keep columns for the next model where there is room."""
        if sum(each.size for each in list(self._kept.values())) + found.size < MOST_KEPT:
            self._kept[place] = found

    def _through_windows(self, place: int, effect: TimeLocalEffect, fit: Fit, signals: Sequence[Signals]) -> Moments:
        """Moments of all windows, on rows that are whitened once."""
        if place not in self._windows:
            self._windows[place] = windows_on_rows(effect, self.observations)
        white = white_torque(effect, self.observations, signals)
        found = windowed_moments(white, self._windows[place], fit)
        if place not in self._numbers and self._count_all:
            self._numbers[place] = float(len(effect.grid))
        elif place not in self._numbers and self._may_count(found):
            self._numbers[place] = windows_tried(found, white, self._windows[place], fit, self._draws(place))
        return found

    def _may_count(self, found: Moments) -> bool:
        """Whether any of many shapes would be worth a look if it were the only one."""
        gains, _ = statistics(found, [False] * found.target.shape[1])
        return float(chdtrc(found.target.shape[1], gains.max(initial=0.0))) < WORTH_COUNTING

    def _draws(self, place: int) -> np.random.Generator:
        """Source of an effect's draws, whichever thread makes them."""
        return np.random.default_rng([self._seed, place])


def model_signals(model: ExtendedModel, observations: Observations) -> list[Signals]:
    """Signals of every piece under a model."""
    return [model.signals(piece) for piece in observations]


def white_columns(
    observations: Observations, effect: Effect, shapes: Array, signals: Sequence[Signals]
) -> dict[int, Array]:
    """Whitened columns (g, c, R_j) of an effect at every joint that it touches.

    Parameters
    ----------
    shapes : (g, k) float64
        shapes
    """
    touched = effect.touched(observations.robot.joint_count)
    rows: dict[int, list[Array]] = {joint: [] for joint in touched}
    count = 1
    for piece, own in zip(observations, signals, strict=True):
        columns = effect.columns(own, shapes)
        count = columns.shape[1]
        for slot, joint in enumerate(touched):
            values = columns[:, :, slot]
            flat = values.reshape(len(shapes) * count, *values.shape[2:])
            rows[joint].append(piece.reduced(np.ascontiguousarray(flat)))
    white = {joint: observations.white(joint, parts) for joint, parts in rows.items()}
    return {joint: each.reshape(len(shapes), count, -1) for joint, each in white.items()}
