"""Where everything else leaves more than noise: forms that show in a small part of the motion only.

Beside what was selected, or in its place: the usual forms of other effects may have taken the largest part of what such
a form makes, and stand at its joint beside which it is no longer seen for what it is.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from service.diagnosis.catalogue import Effect, Setting, farther_effects
from service.diagnosis.fitting.lack_of_fit import lack_of_fit
from service.diagnosis.screening.screen import Screen
from service.diagnosis.selection.choice import Selection
from service.diagnosis.selection.equivalence import EQUIVALENT
from service.diagnosis.selection.selector import WORTH_REFINING, Selector


def looked_farther(
    selection: Selection, selector: Selector, setting: Setting, progress: Callable[[str], None]
) -> Selection:
    """The selection with what such forms explain at the joints where something is left.

    Parameters
    ----------
    selection : Selection
        what there is
    selector : Selector
        that has made it
    setting : Setting
        the arm and the ranges of its motion
    progress : callable
        told the name of the step, and what was found
    """
    forms, chosen = farther_effects(setting), _chosen_at(selection)
    if chosen:
        progress("look farther")
    for joint in chosen:
        own = [form for form in forms if form.joint == joint]
        instead = _in_place(joint, selection, own, selector, progress)
        if _explained(instead) > _explained(selection) + EQUIVALENT:
            selection = instead
    left = lack_of_fit(selection.fit, selector.screen.observations, pure_error=selector.pure_error).worth_a_look
    missing = [each for each in forms if (any(left) if each.joint is None else left[each.joint])]
    if not missing:
        return selection
    if not chosen:
        progress("look farther")
    return _on_forms(missing, selector).continued(selection, progress)


def _on_forms(forms: Sequence[Effect], selector: Selector) -> Selector:
    """The selector with other forms than it has looked at."""
    before = selector.looked_at_before + len(selector.screen.effects)
    screen = Screen(selector.screen.observations, forms)
    return Selector(screen, selector.fitter, selector.held_out, pure_error=selector.pure_error, looked_at_before=before)


def _chosen_at(selection: Selection) -> list[int]:
    """Joints at which something was selected."""
    joints = {choice.options[0].candidate.effect.joint for choice in selection.choices}
    return sorted(joint for joint in joints if joint is not None)


def _in_place(
    joint: int, selection: Selection, forms: Sequence[Effect], selector: Selector, progress: Callable[[str], None]
) -> Selection:
    """What comes of some forms in place of all that was selected at a joint, and of what is missing beside them."""
    places = [at for at, choice in enumerate(selection.choices) if choice.options[0].candidate.effect.joint == joint]
    kept = tuple(choice for at, choice in enumerate(selection.choices) if at not in places)
    cleared = replace(selection, fit=selector.fitter.without(selection.fit, places), choices=kept)
    others = _on_forms(forms, selector)
    most = max((each.gain for each in others.screen.candidates(cleared.fit)), default=0.0)
    if most < WORTH_REFINING * (cleared.fit.energy - selection.fit.energy):
        return selection
    found = others.continued(cleared, progress)
    return selection if found is cleared else selector.continued(found, progress)


def _explained(selection: Selection) -> float:
    """Score of all that was selected: what it explains, less what as many coefficients and shapes would of noise."""
    chosen = [choice.options[0].candidate for choice in selection.choices]
    return -selection.fit.energy - sum(each.gain - each.score for each in chosen)
