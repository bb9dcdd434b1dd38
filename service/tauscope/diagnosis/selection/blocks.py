"""Sums over blocks of a second: nearly independent of one another, whatever the noise's colour."""

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array

BLOCK_S = 1.0
"""Length of a block [s]."""


def add_block_sums(
    total: dict[tuple[int, int], float], recording: NDArray[np.intp], instants: Array, values: Array
) -> None:
    """Add sums of values over blocks of `BLOCK_S` to what is there, by recording and block.

    Parameters
    ----------
    total : dict of (int, int) to float
        sums so far
    recording : (R,) int
        recording of every row
    instants : (R,) float64
        instant of every row [s]
    values : (R,) float64
        what is summed
    """
    blocks = np.floor(instants / BLOCK_S).astype(int)
    width = int(blocks.max(initial=0)) + 1
    places, inverse = np.unique(recording * width + blocks, return_inverse=True)
    for key, value in zip(places, np.bincount(inverse, values), strict=True):
        slot = divmod(int(key), width)
        total[slot] = total.get(slot, 0.0) + float(value)
