"""Findings that held-out motion refutes: they leave the model, and are told apart from those that stand.

The least of them goes first: what it spoiled may have been blamed on a larger one.
"""

from collections.abc import Callable
from dataclasses import replace

from tauscope.diagnosis.findings.finding import Finding, in_order
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.selection.choice import Selection


def set_refuted_apart(
    selection: Selection, find: Callable[[Selection], tuple[Finding, ...]], fitter: Fitter
) -> tuple[Selection, tuple[Finding, ...], tuple[Finding, ...]]:
    """The selection whose findings stand, those findings, and the tentative ones.

    Parameters
    ----------
    find : callable
        the findings of a selection
    """
    tentative: list[Finding] = []
    while True:
        found = find(selection)
        refuted = [each for each in found if each.confirmed is False]
        if not refuted:
            return selection, found, in_order(tentative)
        tentative.append(refuted[-1])
        selection = _without(selection, refuted[-1], fitter)


def _without(selection: Selection, finding: Finding, fitter: Fitter) -> Selection:
    """The selection fitted anew without the terms of one finding."""
    places = [place for place, term in enumerate(selection.fit.model.terms) if any(term is t for t in finding.terms)]
    dropped = [choice for place, choice in enumerate(selection.choices) if place in places]
    kept = tuple(choice for place, choice in enumerate(selection.choices) if place not in places)
    fit = fitter.without(selection.fit, places)
    return replace(selection, fit=fit, choices=kept, rejected=(*selection.rejected, *dropped))
