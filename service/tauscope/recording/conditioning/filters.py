"""Zero-phase smoothing of the motion, and its derivatives."""

from functools import lru_cache

import numpy as np
from scipy import signal

from tauscope.recording.recording import Array

# First derivative of eighth order on nine points: error (2πf/fs)⁸/630: 2e-7 at a tenth of Nyquist, 4e-5 at a fifth.
CENTRAL_DIFFERENCE = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
DIFFERENCE_MARGIN = len(CENTRAL_DIFFERENCE) // 2

# Cut-off of the motion's smoothing filter over that of the common band: it must not bend what the band passes.
STATE_BAND_RATIO = 2.0
SMOOTHED_FRACTION = 0.45  # a cut-off at or above this part of the sampling rate smooths nothing


@lru_cache(maxsize=64)
def _low_pass(rate_hz: float, cutoff_hz: float) -> Array:
    """Fourth-order Butterworth in second-order sections; to design it takes longer than to run it."""
    return np.asarray(signal.butter(4, cutoff_hz, output="sos", fs=rate_hz))


def smooth(values: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Zero-phase low-pass of `values`, (N, n): |H(f)| = 1 / (1 + (f/f_c)⁸), fourth-order Butterworth both ways."""
    if cutoff_hz >= SMOOTHED_FRACTION * rate_hz:
        return values
    sections = _low_pass(rate_hz, cutoff_hz)
    padding = min(smoothing_margin(rate_hz, cutoff_hz), len(values) - 1)
    return signal.sosfiltfilt(sections, values, axis=0, padlen=padding)


def smooth_each(values: Array, rate_hz: float, cutoffs_hz: Array) -> Array:
    """`smooth` the columns of `values`, (N, n), each at a cut-off of its own, `cutoffs_hz`, (n,)."""
    smoothed = np.empty_like(values)
    for cutoff_hz in np.unique(cutoffs_hz):
        alike = cutoffs_hz == cutoff_hz
        smoothed[:, alike] = smooth(values[:, alike], rate_hz, float(cutoff_hz))
    return smoothed


def smoothing_margin(rate_hz: float, cutoff_hz: float) -> int:
    """Samples at each end that `smooth` cannot be trusted with: the slowest pole has decayed to 0.1 %."""
    if cutoff_hz >= SMOOTHED_FRACTION * rate_hz:
        return 0
    return int(np.ceil(3.0 * rate_hz / cutoff_hz))


def derivative(values: Array, rate_hz: float) -> Array:
    """Time derivative of `values`, (N, n), by `CENTRAL_DIFFERENCE`; NaN in `DIFFERENCE_MARGIN` rows at each end."""
    result = np.full_like(values, np.nan)
    inner = len(values) - 2 * DIFFERENCE_MARGIN
    if inner <= 0:
        return result
    total = np.zeros((inner, values.shape[1]))
    for offset, weight in enumerate(CENTRAL_DIFFERENCE):
        if weight:
            total += (weight * rate_hz) * values[offset : offset + inner]
    result[DIFFERENCE_MARGIN:-DIFFERENCE_MARGIN] = total
    return result
