"""All candidates beside one fitted model, refined and fitted where somebody asks."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.refinement import refined
from tauscope.diagnosis.screening.screen import Candidate, Screen, model_signals
from tauscope.diagnosis.selection.choice import Option, Place, driving, outsized, place_of
from tauscope.effects import Effect
from tauscope.effects.computation import side_by_side

Done = TypeVar("Done")


class Table:
    """Candidates beside a model, each worked out once."""

    def __init__(self, fit: Fit, screen: Screen, fitter: Fitter, allowed: Callable[[Effect], bool]) -> None:
        self.fit = fit
        self._screen, self._fitter = screen, fitter
        self._signals = model_signals(fit.model, screen.observations)
        self.candidates = [each for each in screen.candidates(fit, allowed) if each.gain > 0.0]
        self._refined: dict[int, Candidate] = {}
        self._fitted: dict[int, Option] = {}

    def refuse(self, place: Place, but: Sequence[Candidate] = ()) -> None:
        """Leave an effect at a place out from now on.

        Parameters
        ----------
        place : (str, int or None)
            effect and joint
        """
        self.candidates = [each for each in self.candidates if place_of(each) != place or each in but]

    def refined(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Candidates at their best shapes."""
        return _each_once(candidates, self._refined, lambda each: refined(each, self.fit, self._screen, self._signals))

    def fitted(self, candidates: Sequence[Candidate]) -> list[Option]:
        """Refined candidates, each fitted with everything else."""
        return _each_once(candidates, self._fitted, lambda each: fitted_option(each, self.fit, self._fitter))


def _each_once(
    candidates: Sequence[Candidate], known: dict[int, Done], work: Callable[[Candidate], Done]
) -> list[Done]:
    """What comes of each candidate, worked out where it is not known yet."""
    new = [each for each in candidates if id(each) not in known]
    known.update(zip(map(id, new), side_by_side(work, new), strict=True))
    return [known[id(each)] for each in candidates]


def fitted_option(candidate: Candidate, fit: Fit, fitter: Fitter) -> Option:
    """A form added to a model, with everything fitted anew.

    Where the model's own friction would then drive the motion, or the form be no more than what cancels it, friction is
    zero instead of negative: the best of what can be.
    """
    term = Term(candidate.effect, candidate.shape, candidate.coefficients)
    start = with_terms(fit.model, [*fit.model.terms, term])
    stepped = replace(start, parameters=fit.model.parameters + fit.projection.step[: fit.model.structure.size])
    found = fitter.fit(stepped)
    option = Option(candidate, found, fit.energy - found.energy)
    negative = turned_negative(found, fit)
    if negative and (driving(found) - driving(fit) or outsized(option, fitter.observations)):
        found = fitter.fit(_without_friction(found.model, negative))
        return Option(candidate, found, fit.energy - found.energy)
    return option


def turned_negative(found: Fit, before: Fit) -> set[tuple[int, str]]:
    """Joints and coefficients of plain friction that are negative, and were not certainly so before.

    One that was as good as zero may have been either: what drives now drives because of what was added.
    """
    return driving(found, certain=0.0) - driving(before)


def _without_friction(model: ExtendedModel, coefficients: set[tuple[int, str]]) -> ExtendedModel:
    """The model with some coefficients of its plain friction zero as long as its last term is there."""
    columns = [model.structure.coefficient(joint, name) for joint, name in coefficients]
    displaced = tuple(column for column in columns if column is not None)
    parameters = np.array(model.parameters)
    parameters[list(displaced)] = 0.0
    *others, last = model.terms
    return with_terms(replace(model, parameters=parameters), [*others, replace(last, displaced=displaced)])
