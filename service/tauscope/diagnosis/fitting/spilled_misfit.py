"""Misfit that has spilled over from one joint to others: they share the links, whose parameters it bends.

A least-squares fit spreads what is wrong at one joint over every torque that the same masses make. The joint at which
most is left is believed to be wrong itself. Fitted without its rows, nothing bends the links for it; what is then still
left at another joint is that one's own, and the largest of these is left out next, until no more than noise is left at
those that remain.
"""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit


def without_spilled(misfit: LackOfFit, fit: Fit, fitter: Fitter, *, pure_error: bool) -> LackOfFit:
    """A lack of fit whose joints answer for their own misfit only."""
    apart, suspects, wrong = misfit, _significant(misfit), set[int]()
    if len(suspects) < 2:
        return misfit
    while suspects:
        wrong.add(max(suspects, key=lambda joint: apart.excess[joint]))
        rows = fitter.observations.without_joints(wrong)
        apart = lack_of_fit(Fitter(rows).fit(fit.model), rows, pure_error=pure_error)
        suspects = (_significant(apart) & _significant(misfit)) - wrong
    spilled = np.isin(np.arange(len(misfit.excess)), list(_significant(misfit) - wrong))
    tests = ("omnibus", "pure_error", "excess")
    own = {name: np.where(spilled, getattr(apart, name), getattr(misfit, name)) for name in tests}
    return replace(misfit, **own)


def _significant(misfit: LackOfFit) -> set[int]:
    """Joints at which more than noise is left."""
    return {joint for joint, told in enumerate(misfit.significant) if told}
