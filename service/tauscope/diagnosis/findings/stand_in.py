"""How far what is left beside a finding says that it stands in for a law that the catalogue does not have.

A law that is the arm's takes off all but noise where it acts. The laws of the catalogue compete with each other only:
where none of them is the arm's, the nearest one wins, however far it is from it. What gives it away is what it leaves.
With the energy that findings explain at joint j, what smooth functions of state and time still hold there beyond chance
(`tauscope.diagnosis.fitting.lack_of_fit`), and what this finding itself takes off there,

    ℓ = Σ_j w_j left_j / (explained_j + left_j),        w_j ∝ own_j,

and it is a law of the catalogue by 1/(1 + (ℓ/ℓ₀)²) with ℓ₀ = `LEFT`.
"""

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit
from tauscope.effects import Effect

LEFT = 0.15
"""Share that is left from which a name is rather wrong than right. On simulated arms right names left up to 0.05, and
one 0.17, where the arm's formula is not quite the catalogue's; names of what was in no catalogue 0.10 to 0.7."""

DOUBTED = 0.5
"""Certainty below which a finding's statement says why."""


def certainty_as_law(effect: Effect, nominal: Fit, fit: Fit, without: Fit, left: LackOfFit) -> float:
    """Chance that a finding is a law of the catalogue, and not what comes nearest to another one."""
    if effect.is_expected:
        return 1.0
    touched = list(effect.touched(len(left.structured)))
    after, before, alone = (each.joint_energies[touched] for each in (fit, nominal, without))
    own = np.maximum(alone - after, 0.0)
    explained = np.maximum(np.maximum(before - after, own), np.finfo(float).tiny)
    shares = left.structured[touched] / (explained + left.structured[touched])
    share = float(own @ shares) / max(float(own.sum()), np.finfo(float).tiny)
    return 1.0 / (1.0 + (share / LEFT) ** 2)
