"""What would have been seen, had it been there: the smallest size of every effect that these data show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.screening.screen import Candidate
from tauscope.effects.plain_terms import PlainTerm

POWER = 0.9


@dataclass(frozen=True)
class Detectable:
    """The smallest effect that would have been named.

    joint : int or None
        joint index, from 0
    minimum : float or None
        size of the first coefficient [unit]; None where nothing shows it
    """

    effect: str
    joint: int | None
    minimum: float | None
    unit: str
    visible: bool


def detectable(candidates: Sequence[Candidate], level: float, inflation: float) -> tuple[Detectable, ...]:
    """Smallest sizes that are found in nine of ten such data sets."""
    best: dict[tuple[str, int | None], Detectable] = {}
    for each in candidates:
        key = (each.effect.id, each.effect.joint)
        unit = each.effect.coefficients[0].unit
        if not each.visible or each.information <= 0.0:
            best.setdefault(key, Detectable(*key, None, unit, False))
            continue
        strength = needed_strength(each, level)
        size = float(np.sqrt(strength * inflation / each.information))
        if size > each.effect.coefficients[0].largest:  # nothing real is as large as that
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


def needed_strength(candidate: Candidate, level: float) -> float:
    """Noncentrality λ at which a form is significant with probability `POWER`."""
    return _strength(candidate.count, candidate.shapes_tried, level)


def _strength(count: int, shapes_tried: float, level: float) -> float:
    threshold = float(stats.chi2.isf(min(level / shapes_tried, 0.5), count))
    return float(
        optimize.brentq(
            lambda strength: stats.ncx2.sf(threshold, count, strength) - POWER, 1e-6, 100.0 + 10.0 * threshold
        )
    )
