"""How many independent chances a grid of shapes gives to noise.

Neighbouring shapes explain the same noise: of g shapes only n_eff count. With the projected columns' Gram matrix K,
b ~ N(0, K) is what noise does to all columns at once; the tail of max_g bᵀ G_g⁻¹ b over a single shape's χ² tail is
n_eff. No data are needed: it belongs to the design.
"""

from collections.abc import Mapping

import numpy as np
from scipy import stats

from tauscope.diagnosis.fitting.projection import INVISIBLE, Moments
from tauscope.recording.recording import Array

DRAWS = 5000  # draws: 250 of them lie beyond
TAIL = 0.05  # share of the draws that lie beyond where the tails are compared


def effective_number(found: Moments, columns: Mapping[int, Array], rng: np.random.Generator) -> float:
    """Effective number of shapes, at least 1, of whitened `columns`, (g, c, R_j) by joint."""
    shapes, count = found.target.shape
    inner = found.inner.reshape(shapes * count, -1)
    gram = -inner @ inner.T
    for own in columns.values():
        rows = own.reshape(shapes * count, -1)
        gram += rows @ rows.T
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    known = values > 1e-9 * values[-1]
    draws = (vectors[:, known] * np.sqrt(values[known])) @ rng.standard_normal((int(known.sum()), DRAWS))
    visible = np.flatnonzero((found.shares > INVISIBLE).all(axis=1))
    sizes = scale.reshape(shapes, count)[visible]
    own = found.gram[visible] / (sizes[:, :, None] * sizes[:, None, :])
    largest = np.zeros(DRAWS)
    for place, inverse in zip(visible, np.linalg.pinv(own, rcond=1e-9, hermitian=True), strict=True):
        drawn = draws[place * count : (place + 1) * count]
        largest = np.maximum(largest, np.einsum("cd,cd->d", drawn, inverse @ drawn))
    threshold = float(np.quantile(largest, 1.0 - TAIL))
    single = float(stats.chi2.sf(threshold, count))
    return float(np.clip(-np.log1p(-TAIL) / max(single, 1e-12), 1.0, shapes))
