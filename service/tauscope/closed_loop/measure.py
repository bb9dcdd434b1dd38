"""How far the simulated motion is from the real one."""

import numpy as np

from tauscope.recording.recording import Array

LONGEST_LAG_S = 0.25  # largest delay between both motions that is looked for [s]
REVERSAL_S = 0.1  # time on either side of a reversal that belongs to it [s]
MOVES = 0.05  # share of its top speed above which a joint moves: below it, it may rest and turn for noise


def rms_error(measured: Array, simulated: Array) -> Array:
    """Root mean square of the position error per joint, (n,) [rad or m].

    `measured`, `simulated`: (N, n), q of the real and of the simulated arm [rad or m]; NaN where it was missed.
    """
    return np.sqrt(np.nanmean((simulated - measured) ** 2, axis=0))


def worst_error(measured: Array, simulated: Array) -> Array:
    """Largest position error per joint, (n,) [rad or m].

    `measured`, `simulated`: (N, n), q of the real and of the simulated arm [rad or m]; NaN where it was missed.
    """
    return np.nanmax(np.abs(simulated - measured), axis=0)


def lag(time: Array, measured: Array, simulated: Array) -> Array:
    """Delay of the real motion behind the simulated one, (n,) [s]: that at which both differ least.

    `time`: (N,) [s]; `measured`, `simulated`: (N, n), q of the real and of the simulated arm [rad or m]; NaN where it
    was missed.
    """
    step = float(np.median(np.diff(time)))
    reach = int(LONGEST_LAG_S / step)
    found = np.zeros(measured.shape[1])
    shifts = np.arange(-reach, reach + 1)
    at = np.arange(reach, len(time) - reach)
    if not len(at):
        return found
    for joint in range(measured.shape[1]):
        real, other = measured[:, joint], simulated[:, joint]
        errors = np.array([np.nanmean((real[at] - other[at - shift]) ** 2) for shift in shifts])
        best = int(np.argmin(errors))
        if 0 < best < len(shifts) - 1:
            before, least, after = errors[best - 1 : best + 2]
            bend = before - 2.0 * least + after
            found[joint] = step * (shifts[best] + (0.5 * (before - after) / bend if bend > 0.0 else 0.0))
        else:
            found[joint] = step * shifts[best]
    return found


def reversal_error(rows: Array, measured: Array, simulated: Array, time: Array, velocity: Array) -> Array:
    """Rms of the position error within `REVERSAL_S` of a reversal of the real joint, (n,) [rad or m]; NaN without one.

    `rows`: (N,), instants of both positions [s].
    `measured`, `simulated`: (N, n), q of the real and of the simulated arm [rad or m]; NaN where it was missed.
    `time`: (K,), instants of the velocity [s].
    `velocity`: (K, n), of the real arm [rad/s or m/s].
    """
    found = np.full(measured.shape[1], np.nan)
    for joint, speed in enumerate(velocity.T):
        moving = np.flatnonzero(np.abs(speed) > MOVES * np.abs(speed).max())
        turns = np.flatnonzero(np.diff(np.sign(speed[moving])) != 0)
        if not len(turns):
            continue
        instants = 0.5 * (time[moving[turns]] + time[moving[turns + 1]])
        place = np.clip(np.searchsorted(instants, rows), 1, len(instants) - 1) if len(instants) > 1 else None
        near = np.abs(rows - instants[0])
        if place is not None:
            near = np.minimum(np.abs(rows - instants[place]), np.abs(rows - instants[place - 1]))
        error = (simulated - measured)[near <= REVERSAL_S, joint]
        if np.isfinite(error).any():
            found[joint] = float(np.sqrt(np.nanmean(error**2)))
    return found
