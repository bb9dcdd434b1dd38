"""What may be behind a constant torque: an offset, or an effect that these motions hardly tell from one.

Every identified model has a constant, so that nothing else is taken for it. Friction that is larger one way is one
almost everywhere; where the robot file says that there is no constant, it takes the constant's place if it explains the
torque better.
"""

import numpy as np

from tauscope.diagnosis.findings.finding import without_nominal
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.screening.refinement import refined
from tauscope.diagnosis.screening.screen import Candidate, Screen, model_signals
from tauscope.diagnosis.selection.choice import Choice, Option, Selection, distinct, is_physical
from tauscope.diagnosis.selection.equivalence import EQUIVALENT
from tauscope.diagnosis.selection.selector import MOST_FITTED, Selector
from tauscope.diagnosis.selection.table import fitted_option
from tauscope.effects import TimeLocalEffect
from tauscope.effects.computation import side_by_side
from tauscope.effects.plain_terms import TorqueOffset


def instead_of_a_constant(
    effect: TorqueOffset, without: Fit, gain: float, screen: Screen, fitter: Fitter
) -> tuple[Option, ...]:
    """Effects that explain nearly as much as a constant does, in its place, best first.

    Parameters
    ----------
    gain : float
        what the constant takes off that model's residual [noise variances]
    """
    enough = gain - EQUIVALENT * without.inflation()
    there = {(term.effect.id, term.effect.joint) for term in without.model.terms}
    others = [each for each in screen.effects if (each.id, each.joint) not in there]
    near = [each for each in others if each.joint in (effect.joint, None) and not isinstance(each, TimeLocalEffect)]
    lasting = Screen(screen.observations, near)
    touching = [each for each in lasting.candidates(without) if each.gain > 0.5 * enough]
    signals = model_signals(without.model, screen.observations)
    closest = side_by_side(lambda each: refined(each, without, lasting, signals), touching)
    closest.sort(key=lambda each: -each.score)
    options = side_by_side(lambda each: fitted_option(each, without, fitter), closest[:MOST_FITTED])
    near_enough = [each for each in options if each.score > enough - 1.0 and is_physical(each, without)]
    return distinct(sorted(near_enough, key=lambda each: -each.score))


def with_better_than_constants(selection: Selection, selector: Selector) -> Selection:
    """The selection with what explains a joint's torque better than its constant in the constant's place."""
    constants = {term.effect.joint for term in selection.fit.model.terms if term.effect.has_constant}
    for joint in range(selector.screen.observations.robot.joint_count):
        place = selection.nominal.model.structure.coefficient(joint, TorqueOffset.term)
        if place is not None and joint not in constants:
            selection = _exchanged(selection, TorqueOffset(joint), place, selector)
    return selection


def _exchanged(selection: Selection, effect: TorqueOffset, place: int, selector: Selector) -> Selection:
    """The selection with the best effect in the place of one constant, where that explains more and is confirmed."""
    fit, fitter, admission = selection.fit, selector.fitter, selector.admission
    without = without_nominal(fit, place, fitter)
    constant = _constant(effect, fit, place, without.energy - fit.energy)
    inflation = admission.inflation(fit)
    if constant.candidate.p_value(inflation) >= admission.level:
        return selection
    options = instead_of_a_constant(effect, without, constant.gain, selector.screen, fitter)
    if not options or options[0].score <= constant.score:
        return selection
    best = options[0]
    confirmation = None if selector.held_out is None else selector.held_out.confirm(without, best.fit, fitter)
    if confirmation is not None and not confirmation.confirmed(cautious=not admission.pure_error):
        return selection
    near = [each for each in (*options, constant) if each.score > best.score - EQUIVALENT * inflation]
    near.sort(key=lambda each: -each.score)
    choice = Choice(distinct(near), confirmation, admission.p_value(best, without, blocks=True) / admission.level)
    return Selection(selection.nominal, best.fit, (*selection.choices, choice), selection.rejected)


def _constant(effect: TorqueOffset, fit: Fit, place: int, gain: float) -> Option:
    """The constant of a model as an option among others."""
    value = fit.model.parameters[[place]]
    information = float(gain / max(value[0] ** 2, np.finfo(float).tiny))
    candidate = Candidate(effect, np.zeros(0), value, gain, np.array([[information]]), True, 1.0, information)
    return Option(candidate, fit, gain)
