"""Other kinds of a finding that explain nearly as much: which exponent or profile it is, is part of its uncertainty.

With d_i what kind i explains less than the chosen one, its parameters and what the usual kind is preferred by counted,
κ the factor by which the residual exceeds the modelled noise, and no kind more likely beforehand,

    p_i = exp(-d_i / 2κ) / (1 + Σ exp(-d_j / 2κ)).
"""

import numpy as np

from tauscope.diagnosis.findings.elsewhere import Elsewhere
from tauscope.diagnosis.selection.choice import Choice


def kinds_elsewhere(choice: Choice, inflation: float) -> tuple[Elsewhere, ...]:
    """The other kinds of a finding with their chances."""
    behind = np.array([max(each.behind, 0.0) for each in choice.kinds])
    weights = np.exp(-0.5 * behind / inflation)
    chances = weights / (1.0 + weights.sum())
    return tuple(Elsewhere(float(chance), kind.term) for chance, kind in zip(chances, choice.kinds, strict=True))
