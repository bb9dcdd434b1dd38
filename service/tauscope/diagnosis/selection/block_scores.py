"""How much more a term's score scatters from second to second than white noise would let it.

Where the noise is not known from repetitions, whitening is only as good as its model. Sums of the score over blocks of
a second are nearly independent whatever the colour: their squares tell the score's variance.
"""

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.selection.blocks import add_block_sums


def score_inflation(term: Term, before: Fit, after: Fit, screen: Screen) -> tuple[float, int]:
    """Variance of a term's score over blocks, relative to that of white noise of the modelled size."""
    observations = screen.observations
    white = screen.white_columns(term.effect, term.shape[None], model_signals(before.model, observations))
    rows = {joint: term.coefficients @ columns[0] for joint, columns in white.items()}
    inner = np.sum([before.projection.basis[joint] @ row for joint, row in rows.items()], axis=0)
    total: dict[tuple[int, int], float] = {}
    expected = 0.0
    for joint, basis in enumerate(before.projection.basis):
        projected = rows.get(joint, 0.0) - inner @ basis
        expected += float(projected @ projected)
        add_block_sums(total, *observations.row_labels(joint), projected * after.projection.residual[joint])
    sums = np.array(list(total.values()))
    return float(np.sum(sums**2) / max(expected, np.finfo(float).tiny)), len(sums)
