"""Where much is missing at a joint, the nominal friction is no guide to what its rows are uncertain of.

They count fully then, and what a velocity's errors make of reversals passes for a delay or for bristles. Once the
effects are found that were missing, the model with them is a guide, and the selection is made anew from them.
"""

from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.regressor_noise import row_weightings
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Screen
from tauscope.diagnosis.selection.confirmation import HeldOut
from tauscope.diagnosis.selection.selector import Selector


def guided_by(model: ExtendedModel, selector: Selector) -> Selector | None:
    """The selector with rows weighted by a model's friction; None where no joint waits for that."""
    rows = _weighted(selector.screen.observations, model)
    if rows is None:
        return None
    held_out = selector.held_out
    confirming = None if held_out is None else _weighted(held_out.observations, model)
    return Selector(
        Screen(rows, selector.screen.effects),
        Fitter(rows),
        held_out if confirming is None else HeldOut(confirming),
        pure_error=selector.pure_error,
        looked_at_before=selector.looked_at_before,
    )


def _weighted(observations: Observations, model: ExtendedModel) -> Observations | None:
    """The rows weighted anew; None where that guides no joint more than before."""
    waiting = sum(not own.is_guided for own in observations.weightings)
    if not waiting:
        return None
    weightings = row_weightings(observations.with_weightings(()), model)
    if sum(not own.is_guided for own in weightings) >= waiting:
        return None
    return observations.with_weightings(weightings)
