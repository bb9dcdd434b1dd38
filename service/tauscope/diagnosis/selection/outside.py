"""Whether what changes at an instant was there before it or is there after it.

Training recordings cannot say: an effect within a window is the same, with the other sign, as one everywhere outside
it beside nominal parameters that differ by it. Held-out recordings can: they are predicted by those parameters.
"""

from dataclasses import replace

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.selection.choice import Option
from tauscope.diagnosis.selection.confirmation import HeldOut
from tauscope.diagnosis.selection.table import fitted_option
from tauscope.effects import TimeLocalEffect


def where_held_out_shows(option: Option, fit: Fit, fitter: Fitter, held_out: HeldOut | None) -> Option:
    """The option within its window, or everywhere else: what predicts held-out recordings better."""
    term = option.fit.model.terms[-1]
    shape = term.effect.outside(term.shape) if isinstance(term.effect, TimeLocalEffect) else None
    if shape is None or held_out is None:
        return option
    candidate = replace(option.candidate, shape=shape, coefficients=-term.coefficients)
    other = fitted_option(candidate, fit, fitter)
    gained = held_out.block_gains(option.fit.model, other.fit.model).sum()
    return replace(other, gain=option.gain) if gained > 0.0 else option
