"""Where everything else leaves more than noise: forms that show in a small part of the motion only."""

from collections.abc import Callable

from service.diagnosis.catalogue import Setting, farther_effects
from service.diagnosis.fitting.lack_of_fit import lack_of_fit
from service.diagnosis.screening.screen import Screen
from service.diagnosis.selection.choice import Selection
from service.diagnosis.selection.selector import Selector


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
    rows, pure_error = selector.screen.observations, selector.pure_error
    left = lack_of_fit(selection.fit, rows, pure_error=pure_error).significant
    farther = [each for each in farther_effects(setting) if any(left[j] for j in each.touched(len(left)))]
    if not farther:
        return selection
    progress("look farther")
    before = selector.looked_at_before + len(selector.screen.effects)
    screen = Screen(rows, farther)
    beyond = Selector(screen, selector.fitter, selector.held_out, pure_error=pure_error, looked_at_before=before)
    return beyond.continued(selection, progress)
