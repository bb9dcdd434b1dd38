"""Misfit that has spilled over from one joint to others: they share the links, whose parameters it bends.

A least-squares fit spreads what is wrong at one joint over every torque that the same masses make. The joint at which
most is left is believed to be wrong itself. Fitted without its rows, nothing bends the links for it; what is then still
left at another joint is that one's own, and the largest of these is left out next, until no more than noise is left at
those that remain.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from service.diagnosis.fitting.fit import Fit, Fitter
from service.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from service.diagnosis.observations.observations import Observations

LEFT_OUT = 1e-2
"""Weight of the rows of a joint that is left out: parameters that no other joint tells stay what they are."""


def without_spilled(misfit: LackOfFit, fit: Fit, fitter: Fitter, *, pure_error: bool) -> LackOfFit:
    """A lack of fit whose joints answer for their own misfit only.

    Parameters
    ----------
    misfit : LackOfFit
        of the fit
    fit : Fit
        the model at its optimum
    fitter : Fitter
        that has made it
    pure_error : bool
        whether the noise is known from repetitions
    """
    apart, suspects, wrong = misfit, _significant(misfit), set[int]()
    if len(suspects) < 2:
        return misfit
    while suspects:
        wrong.add(max(suspects, key=lambda joint: apart.excess[joint]))
        rows = _without(wrong, fitter.observations)
        apart = lack_of_fit(Fitter(rows).fit(fit.model), rows, pure_error=pure_error)
        suspects = (_significant(apart) & _significant(misfit)) - wrong
    spilled = np.isin(np.arange(len(misfit.excess)), list(_significant(misfit) - wrong))
    tests = ("omnibus", "pure_error", "excess", "structured")
    own = {name: np.where(spilled, getattr(apart, name), getattr(misfit, name)) for name in tests}
    return replace(misfit, **own)


def _significant(misfit: LackOfFit) -> set[int]:
    """Joints at which more than noise is left."""
    return {joint for joint, told in enumerate(misfit.significant) if told}


def _without(joints: Collection[int], observations: Observations) -> Observations:
    """The rows with those of some joints as good as left out."""
    return observations.with_weightings(
        [
            replace(own, weights=own.weights * (LEFT_OUT if joint in joints else 1.0))
            for joint, own in enumerate(observations.weightings)
        ]
    )
