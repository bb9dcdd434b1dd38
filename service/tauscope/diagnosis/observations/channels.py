"""Recorded torque without single wrong samples, and temperature without a sensor's steps."""

import numpy as np
from scipy import ndimage

from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array

SMOOTHED_S = 10.0  # width of the mean that takes out a sensor's steps [s]: a motor's housing warms up over minutes
GRID_HZ = 10.0  # rate at which temperatures are kept [Hz]
NEIGHBOURS = 7  # samples of which the median is what a sample should be near to
SURROUNDINGS = 31  # samples that say how far it may be off where torque changes quickly
FARTHEST = 5.0  # standard deviations, by the median of their magnitudes, up to which a sample counts in full
OF_MEDIAN = 1.4826  # standard deviation of a Gaussian over the median of its magnitude


def read_temperature(conditioner: Conditioner, time: Array) -> Array | None:
    """Temperature of all joints at `time`, (P, N), (n, P, N) [°C]; NaN at joints without a sensor, None without any."""
    if not conditioner.recording.has("temp"):
        return None
    parts = [(each.time, each.temperature) for each in conditioner.usable_samples() if each.temperature is not None]
    if not parts:
        return None
    stamps, values = (np.concatenate(each) for each in zip(*parts, strict=True))
    grid = np.arange(stamps[0], stamps[-1] + 1.0 / GRID_HZ, 1.0 / GRID_HZ)
    found = np.full((values.shape[1], *time.shape), np.nan)
    for joint, own in enumerate(values.T):
        known = np.isfinite(own)
        if known.any():
            slow = np.interp(grid, stamps[known], own[known])
            slow = ndimage.uniform_filter1d(slow, int(SMOOTHED_S * GRID_HZ), mode="nearest")
            found[joint] = np.interp(time, grid, slow)
    return found


def without_spikes(torque: Array) -> Array:
    """The recorded `torque`, (n, N), a row a joint, whose single samples stay within reach of their neighbours.

    Noise with heavy tails, or a bus that now and then delivers a wrong word, leaves samples that no motion makes, of
    which a few weigh more than all others, in windows of time above all. Seen beside the median of its neighbours, each
    counts no more than the rest of the noise does (Hampel's filter, clipped and not replaced): steps and waves, which
    neighbours share, pass as they are; nothing changes where noise is Gaussian.
    """
    if torque.shape[1] < SURROUNDINGS:
        return torque
    middle = ndimage.median_filter(torque, size=(1, NEIGHBOURS), mode="nearest")
    off = torque - middle
    everywhere = OF_MEDIAN * np.median(np.abs(off), axis=1, keepdims=True)
    around = OF_MEDIAN * ndimage.median_filter(np.abs(off), size=(1, SURROUNDINGS), mode="nearest")
    reach = FARTHEST * np.maximum(everywhere, around)
    return np.where(everywhere > 0.0, middle + np.clip(off, -reach, reach), torque)
