"""Numbers of a figure: as many digits as anybody sees."""

import numpy as np

from tauscope.recording.recording import Array

DIGITS = 5


def rounded(values: Array) -> list[float]:
    """Values to `DIGITS` significant digits: a figure's document is a third as long. `values`: (N,), what is drawn."""
    magnitude = np.floor(np.log10(np.maximum(np.abs(values), np.finfo(float).tiny)))
    # Powers of ten beyond what a float holds would turn the smallest numbers into NaN.
    scale = 10.0 ** np.clip(DIGITS - 1 - magnitude, -300.0, 300.0)
    return (np.round(values * scale) / scale).tolist()
