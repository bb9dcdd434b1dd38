"""Fewer points for the same picture."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array


def envelope_indices(values: Array, most: int) -> NDArray[np.intp]:
    """Samples that keep a curve's look: the least and the greatest of each of most/2 equal buckets, in order of time.

    No peak is lost. NaN are passed over, but a bucket that holds nothing else keeps one of them, so that the gap shows.

    Parameters
    ----------
    values : (N,) float64
        the curve

    Returns
    -------
    (M,) intp
        increasing indices, M ≤ max(most, 2)
    """
    count = len(values)
    if count <= most:
        return np.arange(count)
    edges = np.linspace(0, count, max(most // 2, 1) + 1).astype(np.intp)
    kept: list[int] = []
    for start, stop in pairwise(edges):
        bucket = values[start:stop]
        if np.isnan(bucket).all():
            kept.append(int(start))
        else:
            kept += sorted({int(start + np.nanargmin(bucket)), int(start + np.nanargmax(bucket))})
    return np.array(kept, dtype=np.intp)
