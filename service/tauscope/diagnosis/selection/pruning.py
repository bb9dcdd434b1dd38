"""What a model is better without, once all that seemed to be missing is in it."""

import math
from collections.abc import Sequence
from dataclasses import replace

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.fitting.spilled_misfit import without_spilled
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.selection.admission import Admission
from tauscope.diagnosis.selection.choice import Choice, Selection
from tauscope.diagnosis.selection.proxies import proxies, weak_likenesses
from tauscope.diagnosis.selection.shape_error import HARDLY, groups_of, standings
from tauscope.effects.computation import THREADS, side_by_side

Pruned = tuple[Fit, list[Choice]]
"""A model, and the choices that are left in it."""


def without_superfluous(fit: Fit, choices: list[Choice], fitter: Fitter, admission: Admission) -> Pruned:
    """Drop terms that the others have made superfluous, the weakest first."""
    losses: dict[Choice, float] = {}
    while choices:
        weakest, without = _weakest(fit, choices, losses, fitter)
        candidate = replace(choices[weakest].options[0].candidate, gain=max(losses[choices[weakest]], 0.0))
        if candidate.p_value(admission.inflation(fit), refined=True) < admission.level:
            break
        fit = without
        choices = [choice for place, choice in enumerate(choices) if place != weakest]
    return fit, choices


def _weakest(fit: Fit, choices: Sequence[Choice], losses: dict[Choice, float], fitter: Fitter) -> tuple[int, Fit]:
    """Place of the choice without which least is lost, and the fit without it; `losses` are brought up to date.

    What was lost beside more choices is hardly less beside fewer: they are asked anew in that order, until those that
    are left cannot lose less than the least that was found.
    """
    waiting = sorted(range(len(choices)), key=lambda place: losses.get(choices[place], -math.inf))
    least, weakest, found = math.inf, 0, fit
    while waiting and losses.get(choices[waiting[0]], -math.inf) < least:
        count = max(THREADS, sum(choices[place] not in losses for place in waiting))
        asked, waiting = waiting[:count], waiting[count:]
        for place, without in zip(asked, _each_without([[place] for place in asked], fit, fitter), strict=True):
            losses[choices[place]] = without.energy - fit.energy
            if losses[choices[place]] < least:
                least, weakest, found = losses[choices[place]], place, without
    return weakest, found


def without_weak_likenesses(nominal: Fit, fit: Fit, choices: list[Choice], fitter: Fitter) -> Pruned:
    """Drop all choices at joints where even all of them together leave most of what there is to explain."""
    return _without(weak_likenesses(nominal, fit, choices, fitter.observations), fit, choices, fitter)


def without_proxies(nominal: Fit, fit: Fit, choices: list[Choice], fitter: Fitter, admission: Admission) -> Pruned:
    """Drop what only stands in for an effect that the catalogue does not have, and what was needed for that alone."""
    dropped = proxies(nominal, fit, choices, fitter.observations, pure_error=admission.pure_error)
    if dropped:
        fit, choices = without_superfluous(*_without(dropped, fit, choices, fitter), fitter, admission)
    return _without_spilled(fit, choices, fitter, admission)


def _without_spilled(fit: Fit, choices: list[Choice], fitter: Fitter, admission: Admission) -> Pruned:
    """Drop what is superfluous as soon as no link is bent for joints at which more than noise is left.

    What explains more than all that is left there is not made by it. Superfluous it may be all the same: a wrong gain
    of the last joint is, by itself, a change of its link's masses, which only other joints' rows tell apart.
    """
    if not choices:
        return fit, choices
    misfit = lack_of_fit(fit, fitter.observations, pure_error=admission.pure_error)
    left = without_spilled(misfit, fit, fitter, pure_error=admission.pure_error).significant
    wrong = {joint for joint, told in enumerate(left) if told}
    if not wrong:
        return fit, choices
    beyond = float(misfit.excess[list(wrong)].sum())
    stays = [_is_of(wrong, choice, len(left)) or choice.options[0].gain > beyond for choice in choices]
    if all(stays):
        return fit, choices
    apart = Fitter(fitter.observations.without_joints(wrong))
    _, needed = without_superfluous(apart.fit(fit.model), choices, apart, admission)
    spilled = [place for place, choice in enumerate(choices) if choice not in needed and not stays[place]]
    return _without(spilled, fit, choices, fitter)


def _is_of(joints: set[int], choice: Choice, joint_count: int) -> bool:
    """Whether a choice stands at one of some joints, or touches no other."""
    effect = choice.options[0].candidate.effect
    return effect.joint in joints or joints.issuperset(effect.touched(joint_count))


def without_errors_of_larger_ones(selection: Selection, fitter: Fitter, admission: Admission) -> Selection:
    """Drop what is hardly more than an error of the formula of a larger effect at the same joint.

    Last of all: as long as others are looked for, what such an error explains must not be there for them to explain.
    One at a time: of two that share what the larger one leaves, neither has to be an error where the other is none.
    """
    while len(groups := list(groups_of(selection.fit.model).values())) > 1:
        fit = selection.fit
        without = _each_without(groups, fit, fitter)
        found = standings(selection.nominal, fit, without, fitter, admission.inflation(fit))
        least = min(range(len(groups)), key=lambda number: found[number].certainty)
        if found[least].certainty >= HARDLY:
            break
        fit, choices = _without(groups[least], fit, list(selection.choices), fitter)
        selection = replace(selection, fit=fit, choices=tuple(choices))
    return selection


def _each_without(groups: Sequence[Sequence[int]], fit: Fit, fitter: Fitter) -> list[Fit]:
    """The model fitted anew without each of some groups of its terms."""
    return side_by_side(lambda places: fitter.without(fit, places), groups)


def _without(dropped: Sequence[int], fit: Fit, choices: list[Choice], fitter: Fitter) -> Pruned:
    """The model fitted anew without some choices."""
    if not dropped:
        return fit, choices
    kept = [place for place in range(len(choices)) if place not in dropped]
    terms = [fit.model.terms[place] for place in kept]
    return fitter.fit(with_terms(fit.model, terms)), [choices[place] for place in kept]
