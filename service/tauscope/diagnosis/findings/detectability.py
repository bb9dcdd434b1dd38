"""What would have been seen, had it been there: the smallest size of every effect that these data show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import INVISIBLE, Moments, moments
from tauscope.diagnosis.fitting.white_columns import SHAPES_AT_ONCE, white_columns
from tauscope.diagnosis.observations.observations import Observations
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import side_by_side
from tauscope.effects.plain_terms import PlainTerm
from tauscope.recording.recording import Array

POWER = 0.9  # chance at which an effect of the smallest size is found
DRAWS = 5000  # draws: 250 of them lie beyond
TAIL = 0.05  # share of the draws that lie beyond where the tails are compared


@dataclass(frozen=True)
class Detectable:
    """The smallest effect that would have been named."""

    effect: str
    joint: int | None  # joint index, from 0
    minimum: float | None  # size of the first coefficient [unit]; None where nothing shows it
    unit: str
    visible: bool


@dataclass(frozen=True)
class Visibility:
    """How much a form of an effect shows beside a fitted model."""

    effect: Effect
    # energy of the first column that shows, for a size of one, at a usual shape; zero where none does [noise variances]
    information: float
    shapes_tried: float  # effective number of shapes among which chance may choose

    def needed_strength(self, level: float) -> float:
        """Noncentrality λ at which the form is significant with probability `POWER`."""
        return _strength(len(self.effect.coefficients), self.shapes_tried, level)


def visibilities(fit: Fit, observations: Observations, effects: Sequence[Effect]) -> list[Visibility]:
    """Forms of effects beside a fitted model."""
    signals = [fit.model.signals(piece) for piece in observations]
    seeds = range(len(effects))
    return side_by_side(lambda seed: _visibility(fit, observations, effects[seed], signals, seed), seeds)


def _visibility(
    fit: Fit, observations: Observations, effect: Effect, signals: Sequence[Signals], seed: int
) -> Visibility:
    """One form, by shapes drawn from its grid; all others count as these do."""
    rng = np.random.default_rng(seed)
    drawn = rng.permutation(len(effect.grid))[:SHAPES_AT_ONCE]
    shapes = effect.grid[np.sort(drawn)]
    columns = white_columns(observations, effect, shapes, signals)
    found = moments(fit.projection, columns)
    alike = np.array([each.unit == effect.coefficients[0].unit for each in effect.coefficients])
    shows = (found.shares > INVISIBLE) & alike
    visible, first = shows.any(axis=1), shows.argmax(axis=1)
    if not visible.any():
        return Visibility(effect, 0.0, 1.0)
    number = effective_number(found, columns, rng) if len(shapes) > 1 else 1.0
    information = float(np.median(found.gram[visible, first[visible], first[visible]]))
    return Visibility(effect, information, number * len(effect.grid) / len(shapes))


def detectable(forms: Sequence[Visibility], level: float, inflation: float) -> tuple[Detectable, ...]:
    """Smallest sizes that are found in nine of ten such data sets."""
    best: dict[tuple[str, int | None], Detectable] = {}
    for each in forms:
        key = (each.effect.id, each.effect.joint)
        unit = each.effect.coefficients[0].unit
        shows = each.information > 0.0
        size = float(np.sqrt(each.needed_strength(level) * inflation / each.information)) if shows else np.inf
        if not shows or size > each.effect.coefficients[0].largest:  # nothing real is as large as that
            best.setdefault(key, Detectable(*key, None, unit, False))
            continue
        known = best.get(key)
        if known is None or known.minimum is None or size < known.minimum:
            best[key] = Detectable(*key, size, unit, True)
    return tuple(best.values())


def detectable_parameters(
    fit: Fit, kinds: Sequence[type[PlainTerm]], level: float, inflation: float
) -> tuple[Detectable, ...]:
    """The same for effects that are parameters of the nominal model, from their standard errors."""
    found = []
    for kind in kinds:
        for joint in range(fit.model.structure.robot.joint_count):
            place = fit.model.structure.coefficient(joint, kind.term)
            if place is None:
                continue
            variance = float(fit.covariance[place, place]) * inflation
            size = float(np.sqrt(_strength(1, 1.0, level) * variance)) if variance > 0.0 else None
            found.append(Detectable(kind.id, joint, size, kind.coefficients[0].unit, size is not None))
    return tuple(found)


def _strength(count: int, shapes_tried: float, level: float) -> float:
    threshold = float(stats.chi2.isf(min(level / shapes_tried, 0.5), count))
    return float(
        optimize.brentq(
            lambda strength: stats.ncx2.sf(threshold, count, strength) - POWER, 1e-6, 100.0 + 10.0 * threshold
        )
    )


def effective_number(found: Moments, columns: Mapping[int, Array], rng: np.random.Generator) -> float:
    """Effective number of shapes, at least 1, of whitened `columns`, (g, c, R_j) by joint.

    Neighbouring shapes explain the same noise: of g shapes only n_eff count. With the projected columns' Gram matrix K,
    b ~ N(0, K) is what noise does to all columns at once; the tail of max_g bᵀ G_g⁻¹ b over a single shape's χ² tail is
    n_eff. No data are needed: it belongs to the design.
    """
    shapes, count = found.target.shape
    inner = found.inner.reshape(shapes * count, -1)
    raw = sum(own.reshape(shapes * count, -1) @ own.reshape(shapes * count, -1).T for own in columns.values())
    gram = raw - inner @ inner.T
    # What is invisible is nothing but rounding: by its own size it would be noise as large as any.
    scale = np.sqrt(np.maximum(np.diag(gram), INVISIBLE * np.diag(raw) + np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    known = values > 1e-9 * values[-1]
    draws = (vectors[:, known] * np.sqrt(values[known])) @ rng.standard_normal((int(known.sum()), DRAWS))
    visible = np.flatnonzero((found.shares > INVISIBLE).any(axis=1))
    sizes = scale.reshape(shapes, count)[visible]
    own = found.gram[visible] / (sizes[:, :, None] * sizes[:, None, :])
    largest = np.zeros(DRAWS)
    for place, inverse in zip(visible, np.linalg.pinv(own, rcond=1e-9, hermitian=True), strict=True):
        drawn = draws[place * count : (place + 1) * count]
        largest = np.maximum(largest, np.einsum("cd,cd->d", drawn, inverse @ drawn))
    threshold = float(np.quantile(largest, 1.0 - TAIL))
    single = float(stats.chi2.sf(threshold, count))
    return float(np.clip(-np.log1p(-TAIL) / max(single, 1e-12), 1.0, shapes))
