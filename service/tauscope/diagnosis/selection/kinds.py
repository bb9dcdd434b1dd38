"""The kinds of one effect at one place: another exponent, profile, filter or side, each fitted with everything else.

Kinds are compared by their columns beside a model that lacks the effect, before anything is fitted; and one fit may
stop where it lets a constant of the friction curve go no farther. Once all that is missing is in the model, each effect
takes its best kind and goes on to its optimum; the others say how far its parameters depend on that choice.
"""

from collections.abc import Sequence
from dataclasses import replace

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import scaled_back
from tauscope.diagnosis.screening.refinement import best_of_shapes, refined_kinds
from tauscope.diagnosis.screening.screen import Candidate, Screen, model_signals
from tauscope.diagnosis.selection.choice import Choice, Kind, Option, Selection, is_physical, outsized, place_of
from tauscope.diagnosis.selection.equivalence import FORMULA_ERROR, doubt
from tauscope.diagnosis.selection.pruning import without_superfluous
from tauscope.diagnosis.selection.selector import WORTH_REFINING, Selector
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import side_by_side

FARTHER = 1.0
"""What a fit has to explain more to take another's place, in units of what counts as one noise variance between them:
for another kind, which is another formula, more than noise does."""


def with_best_kinds(selection: Selection, selector: Selector) -> Selection:
    """The selection with every effect in its best kind, and with what its others explain; waves have but one."""
    improved = False
    for choice in selection.choices:
        if choice.options[0].candidate.effect.repeats:
            continue
        place = selection.choices.index(choice)
        weighed, fit = _weighed(selection.fit, choice, place, selector)
        improved |= fit is not selection.fit
        choices = [*selection.choices[:place], *selection.choices[place + 1 :]]
        at = place if fit is selection.fit else len(choices)  # a fit has its new term last
        selection = replace(selection, fit=fit, choices=(*choices[:at], weighed, *choices[at:]))
    if not improved:
        return selection
    fit, kept = without_superfluous(selection.fit, list(selection.choices), selector.fitter, selector.admission)
    return replace(selection, fit=fit, choices=tuple(kept))


def _weighed(fit: Fit, choice: Choice, place: int, selector: Selector) -> tuple[Choice, Fit]:
    """A choice with its best kind in front, and the model with that, its term last; the same model where it has it."""
    term, without = fit.model.terms[place], selector.fitter.without(fit, [place])
    there, options = _fitted_kinds(term, without, fit, choice, selector)
    best, inflation = there, selector.admission.inflation(fit)
    for option in sorted(options, key=lambda each: -_preference(each)):
        alike = _kind(option) == _kind(there)
        unit = inflation if alike else doubt(there, option, inflation, FORMULA_ERROR)
        if _preference(option) <= _preference(there) + FARTHER * unit:
            continue
        confirmation = selector.confirmation(without, option)
        if confirmation is None or confirmation.confirmed(cautious=not selector.pure_error):
            best = option
            choice = replace(choice, options=(best, *choice.options[1:]), confirmation=confirmation)
            break
    terms = [(there, scaled_back(fit.model, term))]
    terms += [(each, scaled_back(each.fit.model, each.fit.model.terms[-1])) for each in options]
    kinds = {_kind(each): Kind(_preference(best) - _preference(each), own) for each, own in terms}
    kinds.pop(_kind(best))
    return replace(choice, kinds=tuple(kinds.values())), best.fit


def _fitted_kinds(
    term: Term, without: Fit, fit: Fit, choice: Choice, selector: Selector
) -> tuple[Option, list[Option]]:
    """A term as it is in the model; and all kinds of it that can be, each fitted from there, last of its model.

    Its own kind is fitted again: where a constant of the friction curve was stopped, that goes on.
    """
    fitter, screen = selector.fitter, selector.screen
    signals = model_signals(without.model, screen.observations)
    known = choice.options[0].candidate
    _, own = best_of_shapes(known, term.effect, term.shape[None], without, screen, signals)

    def fitted(candidate: Candidate) -> Option:
        start = replace(term, effect=candidate.effect, shape=candidate.shape, coefficients=candidate.coefficients)
        found = fitter.fit(with_terms(fit.model, [*without.model.terms, start]))
        return Option(candidate, found, without.energy - found.energy)

    tried = side_by_side(fitted, [own, *_other_kinds(own, without, screen, signals)])
    options = [each for each in tried if is_physical(each, without) and not outsized(each, fitter.observations)]
    return Option(own, fit, without.energy - fit.energy), options


def _other_kinds(own: Candidate, without: Fit, screen: Screen, signals: Sequence[Signals]) -> list[Candidate]:
    """All other kinds that explain nearly as much before they are fitted."""
    forms = [each for each in screen.effects if (each.id, each.joint) == place_of(own) and each is not own.effect]
    starts = [best_of_shapes(own, each, each.grid, without, screen, signals)[1] for each in forms]
    found = refined_kinds(own, without, screen, signals)[1:]
    found += [kind for start in starts for kind in refined_kinds(start, without, screen, signals)]
    return [each for each in found if each.gain > WORTH_REFINING * own.gain]


def _preference(option: Option) -> float:
    """What a kind explains, less what as many parameters would of noise, and what the usual kind is preferred by."""
    effect, shape = option.candidate.effect, option.candidate.shape
    free = sum(effect.is_free(place) for place in range(len(shape)))
    return option.gain - option.candidate.count - free - float(effect.reluctance(shape[None])[0])


def _kind(option: Option) -> tuple[Effect, tuple[float, ...]]:
    """What tells kinds apart: the form, and those of its shapes that are only chosen."""
    effect, shape = option.candidate.effect, option.candidate.shape
    return effect, tuple(float(value) for place, value in enumerate(shape) if not effect.is_free(place))
