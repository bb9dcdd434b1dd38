"""What a great many columns leave of a residual: the most telling one after the other, none that chance would do."""

import numpy as np

from tauscope.recording.recording import Array

MOST_TAKEN = 40
"""Columns that are taken at most, and not more than one in `ROWS_A_COLUMN` rows."""

ROWS_A_COLUMN = 25

SAME_COLUMN = 1e-4
"""Part of a column outside those that are taken, below which it is one of them: its square is all that a Gram matrix
knows of it, to some eight digits there."""

EMPTY = 1e-9
"""Length of a column relative to the longest, below which it is none."""

BEYOND_CHANCE = 6.0
"""What a column has to take off more than the best of as many would of noise [noise variances]."""

LEAST_LEFT = 0.2
"""Part of the rows that are believed to be left to noise, however much chance may have taken."""


def pursued(columns: Array, residual: Array) -> Array:
    """What orthogonal matching pursuit leaves of a residual, at the size that noise had before columns were chosen.

    Columns are made orthogonal to those taken in their Gram matrix G alone, which is far smaller than they are: with c
    the row of the one taken over the root of its diagonal element and s the scores, G - c cᵀ and s - c s_c (Rubinstein,
    Zibulevsky and Elad, Technion CS-2008-08, 2008).

    Parameters
    ----------
    columns : (k, R) float64
        what may explain it, in any unit
    residual : (R,) float64
        what is to be explained

    Returns
    -------
    (R,) float64
        what is left
    """
    norms = np.linalg.norm(columns, axis=1)
    told = norms > EMPTY * max(norms.max(initial=0.0), np.finfo(float).tiny)
    if not told.any():
        return residual
    unit = columns[told] / norms[told, None]
    best_of_many = 2.0 * np.log(len(unit))
    energy, taken = float(residual @ residual), []
    gram, scores = unit @ unit.T, unit @ residual
    for _ in range(min(MOST_TAKEN, len(residual) // ROWS_A_COLUMN)):
        outside = np.diag(gram)
        gains = np.where(outside > SAME_COLUMN**2, scores**2 / np.maximum(outside, SAME_COLUMN**2), 0.0)
        best = int(np.argmax(gains))
        if gains[best] < (best_of_many + BEYOND_CHANCE) * energy / len(residual):
            break
        taken.append(best)
        energy -= float(gains[best])
        length = np.sqrt(outside[best])
        shared, score = gram[best] / length, scores[best] / length
        gram, scores = gram - np.outer(shared, shared), scores - score * shared
    solution, *_ = np.linalg.lstsq(unit[taken].T, residual)
    left = residual - solution @ unit[taken]
    # Each column, chosen among many, took this much noise with it.
    return left * np.sqrt(len(left) / max(len(left) - best_of_many * len(taken), LEAST_LEFT * len(left)))
