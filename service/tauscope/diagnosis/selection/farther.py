"""Where everything else leaves more than noise: forms that show in a small part of the motion only.

Beside what was selected, or in its place: the usual forms of other effects may have taken the largest part of what such
a form makes, and stand at its joint beside which it is no longer seen for what it is.
"""

from collections.abc import Callable
from dataclasses import replace

from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.fitting.spilled_misfit import without_spilled
from tauscope.diagnosis.screening.screen import Screen
from tauscope.diagnosis.selection.choice import Place, Selection, place_of
from tauscope.diagnosis.selection.equivalence import EQUIVALENT
from tauscope.diagnosis.selection.proxies import FULL
from tauscope.diagnosis.selection.selector import WORTH_REFINING, Selector
from tauscope.effects import ArmContext, Effect, farther_effects

Stand = tuple[int, set[Place]]
"""A joint, and effects that were selected there."""


def looked_farther(
    selection: Selection, selector: Selector, setting: ArmContext, progress: Callable[[str], None]
) -> Selection:
    """The selection with what such forms explain: in the place of what was found, and beside it where some is left."""
    chosen = stands(selection)
    screen = Screen(selector.screen.observations, farther_effects(setting))
    if chosen:
        progress("look farther")
    for stand in chosen:
        instead = _in_place(stand, selection, screen, selector, progress)
        if explained(instead) > explained(selection) + EQUIVALENT:
            selection = instead
    left = _left(selection, selector)
    if not any(left):
        return selection
    near = {joint for joint, told in enumerate(left) if told} | {joint for joint, _ in stands(selection)}
    others = _with(screen, selector, lambda each: each.joint is None or each.joint in near)
    if not chosen:
        progress("look farther")
    return others.continued(selection, progress)


def _left(selection: Selection, selector: Selector) -> list[bool]:
    """Per joint, whether more than noise is left, and not only for another one that bends the links."""
    pure_error = selector.pure_error
    misfit = lack_of_fit(selection.fit, selector.screen.observations, pure_error=pure_error)
    return without_spilled(misfit, selection.fit, selector.fitter, pure_error=pure_error).worth_a_look


def _with(screen: Screen, selector: Selector, wanted: Callable[[Effect], bool], *, instead: bool = False) -> Selector:
    """The selector with other forms than it has looked at."""
    return Selector(
        screen,
        selector.fitter,
        selector.held_out,
        pure_error=selector.pure_error,
        looked_at_before=selector.looked_at_before + len(selector.screen.effects),
        wanted=wanted,
        instead=instead,
    )


def stands(selection: Selection) -> list[Stand]:
    """All that was selected at each joint, and where it is several effects each of them by itself.

    Not where they are so many that together they are no physics: what they stand in for is all that is there.
    """
    at: dict[int, set[Place]] = {}
    for choice in selection.choices:
        effect, joint = place_of(choice.options[0].candidate)
        if joint is not None:
            at.setdefault(joint, set()).add((effect, joint))
    found = []
    for joint, effects in sorted(at.items()):
        found.append((joint, effects))
        if 1 < len(effects) < FULL:
            found += [(joint, {each}) for each in sorted(effects)]
    return found


def _in_place(
    stand: Stand, selection: Selection, screen: Screen, selector: Selector, progress: Callable[[str], None]
) -> Selection:
    """What comes of such forms in the place of some choices of a joint, and of what is missing beside them."""
    joint, effects = stand
    places = [at for at, choice in enumerate(selection.choices) if place_of(choice.options[0].candidate) in effects]
    if not places:  # what took another's place has left nothing to stand here
        return selection
    kept = tuple(choice for at, choice in enumerate(selection.choices) if at not in places)
    cleared = replace(selection, fit=selector.fitter.without(selection.fit, places), choices=kept)
    others = _with(screen, selector, lambda each: each.joint == joint, instead=True)
    most = max((each.gain for each in screen.candidates(cleared.fit, others.wanted)), default=0.0)
    if most < WORTH_REFINING * (cleared.fit.energy - selection.fit.energy):
        return selection
    found = others.continued(cleared, progress)
    return selection if found is cleared else selector.continued(found, progress)


def explained(selection: Selection) -> float:
    """Score of all that was selected: what it explains, less what as many coefficients and shapes would of noise.

    Less also what some of these shapes have to explain before they are preferred to plainer ones.
    """
    chosen = [choice.options[0].candidate for choice in selection.choices]
    doubt = sum(float(each.effect.reluctance(each.shape[None])[0]) for each in chosen)
    return -selection.fit.energy - sum(each.gain - each.score for each in chosen) - doubt
