"""What happens once, or changes with time, differs from one repetition to the next, as noise does, and is none.

Left in the differences between repetitions, a payload that is dropped or friction that falls would be taken for noise
of its own size and colour, and whitened away. So before the noise is settled, such effects are screened as if it were
white, and a term that makes the repetitions agree better is taken out of their differences, for that purpose only.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.noise.floor import white_noise, with_noise, with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.refinement import refined
from tauscope.diagnosis.screening.screen import Candidate, Screen, model_signals
from tauscope.effects import Effect
from tauscope.effects.computation import side_by_side
from tauscope.recording.recording import Array

MOST_EVENTS = 3

LOOKED_AT = 3
"""Forms, best first, that are tried in each round."""

CHANCE = 1e-4
"""Chance, if all that the model leaves were white noise, beyond which a window is not looked into."""

BETTER = 0.97
"""Part of the noise's variance at some joint that is left at most where repetitions really agree better."""

WORSE = 1.02


def beside_events(
    observations: Observations, known: Observations, model: ExtendedModel, effects: Sequence[Effect]
) -> tuple[Observations, bool]:
    """The observations with the noise that is left beside what happens once, and whether repetitions still tell it."""
    passing = [effect for effect in effects if not effect.repeats_with_motion]
    best, pure_error = known, True
    rows = observations.with_noise(white_noise(observations, model))
    screen, fitter = Screen(rows, passing, count_all=True), Fitter(rows)
    fit = fitter.projected(model)
    for _ in range(MOST_EVENTS):
        likely = [each for each in screen.candidates(fit) if each.p_value() < CHANCE]
        ranked = sorted(likely, key=lambda each: -each.score)
        for each in _fitted(ranked[:LOOKED_AT], fit, screen, fitter):
            agreed = with_pure_error(observations, each.model)
            if agreed is None or not _agree_better(_variances(agreed), _variances(best)):
                continue
            found, still_pure = with_noise(observations, each.model, effects)
            if still_pure:
                fit, best, pure_error = each, found, still_pure
                break
        else:
            break
    return best, pure_error


def _fitted(candidates: Sequence[Candidate], fit: Fit, screen: Screen, fitter: Fitter) -> list[Fit]:
    """The model with each of some candidates at its best shape: near enough for what repetitions differ by."""
    signals = model_signals(fit.model, screen.observations)

    def fitted(candidate: Candidate) -> Fit:
        best = refined(candidate, fit, screen, signals)
        term = Term(best.effect, best.shape, best.coefficients)
        return fitter.fit(with_terms(fit.model, [*fit.model.terms, term]), steps=0)

    return side_by_side(fitted, candidates)


def _variances(observations: Observations) -> Array:
    return np.array([noise.model.variance for noise in observations.noise])


def _agree_better(found: Array, before: Array) -> bool:
    """Whether the noise is smaller somewhere, and larger nowhere."""
    ratio = found / before
    return bool(ratio.min() < BETTER and ratio.max() < WORSE)
