"""Single samples far outside the noise: a few of them weigh more than all others, in windows of time above all.

Noise with heavy tails, or a bus that now and then delivers a wrong word, leaves samples that no motion makes. Seen
beside the median of its neighbours, each counts no more than the rest of the noise does (Hampel's filter, clipped and
not replaced): steps and waves, which neighbours share, pass as they are; nothing changes where noise is Gaussian.
"""

import numpy as np
from scipy import ndimage

from tauscope.recording.recording import Array

NEIGHBOURS = 7  # samples of which the median is what a sample should be near to
SURROUNDINGS = 31  # samples that say how far it may be off where torque changes quickly
FARTHEST = 5.0  # standard deviations, by the median of their magnitudes, up to which a sample counts in full
OF_MEDIAN = 1.4826  # standard deviation of a Gaussian over the median of its magnitude


def without_spikes(torque: Array) -> Array:
    """The recorded `torque`, (n, N), a row a joint, whose single samples stay within reach of their neighbours."""
    if torque.shape[1] < SURROUNDINGS:
        return torque
    middle = ndimage.median_filter(torque, size=(1, NEIGHBOURS), mode="nearest")
    off = torque - middle
    everywhere = OF_MEDIAN * np.median(np.abs(off), axis=1, keepdims=True)
    around = OF_MEDIAN * ndimage.median_filter(np.abs(off), size=(1, SURROUNDINGS), mode="nearest")
    reach = FARTHEST * np.maximum(everywhere, around)
    return np.where(everywhere > 0.0, middle + np.clip(off, -reach, reach), torque)
