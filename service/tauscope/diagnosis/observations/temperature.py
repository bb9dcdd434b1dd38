"""Temperatures of the joints at given instants: sensors are slow and report whole degrees."""

import numpy as np
from scipy import ndimage

from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array

SMOOTHED_S = 10.0  # width of the mean that takes out a sensor's steps [s]: a motor's housing warms up over minutes
GRID_HZ = 10.0  # rate at which temperatures are kept [Hz]


def read_temperature(conditioner: Conditioner, time: Array) -> Array | None:
    """Temperature of every joint.

    Returns (n, P, N), [°C]; NaN at joints without a sensor, None where there is none. `time`: (P, N), instants on the
    recording's clock [s].
    """
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
