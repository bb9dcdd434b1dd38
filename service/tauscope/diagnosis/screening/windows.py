"""A great many windows on one torque, screened at the cost of one.

The torque's columns are made, filtered and whitened once; a window then weights their rows. Beside the exact columns,
which are windowed first, that is off at the edges by the filter's length only: it finds the window, and whoever refines
it takes the exact ones.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import sparse, stats

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import INVISIBLE, Moments
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.effective_number import TAIL
from tauscope.effects.context import Signals
from tauscope.effects.time_local import IndexArray, TimeLocalEffect, open_samples, open_share
from tauscope.recording.recording import Array

DRAWS = 400
"""Draws of noise from which the effective number of windows is estimated."""

Windows = Mapping[int, sparse.csr_array]
"""By joint, the share (g, R_j) to which every window is open at every whitened row."""


def windows_on_rows(effect: TimeLocalEffect, observations: Observations) -> Windows:
    """Every window of an effect's grid on the rows of the joints that it touches."""
    interval = 1.0 / observations.pieces[0].prepared.motion.band.rate_hz
    return {
        joint: _on_rows(effect.grid, *observations.row_labels(joint), interval)
        for joint in effect.touched(observations.robot.joint_count)
    }


def _on_rows(shapes: Array, recording: IndexArray, instants: Array, interval_s: float) -> sparse.csr_array:
    """The share (g, R) to which every window is open at every row; where it is shut costs nothing."""
    shares, windows, rows = [], [], []
    for each in np.unique(recording):
        at = np.flatnonzero(recording == each)
        first, last = open_samples(shapes, int(each), instants[at], interval_s)
        counts = np.maximum(last - first, 0)
        window = np.repeat(np.arange(len(shapes)), counts)
        sample = np.arange(len(window)) + np.repeat(first - np.cumsum(counts) + counts, counts)
        shares.append(open_share(shapes[window], int(each), instants[at[sample]], interval_s))
        windows.append(window)
        rows.append(at[sample])
    content = (np.concatenate(shares), (np.concatenate(windows), np.concatenate(rows)))
    found = sparse.csr_array(content, shape=(len(shapes), len(recording)))
    found.eliminate_zeros()
    return found


def white_torque(effect: TimeLocalEffect, observations: Observations, signals: Sequence[Signals]) -> dict[int, Array]:
    """The effect's torque without any window, whitened, (c, R_j) a joint."""
    touched = effect.touched(observations.robot.joint_count)
    rows: dict[int, list[Array]] = {joint: [] for joint in touched}
    for piece, own in zip(observations, signals, strict=True):
        torque = effect.torque(own, effect.grid[0])
        for slot, joint in enumerate(touched):
            rows[joint].append(piece.reduced(np.ascontiguousarray(torque[:, slot])))
    return {joint: observations.white(joint, parts) for joint, parts in rows.items()}


def windowed_moments(white: Mapping[int, Array], windows: Windows, fit: Fit) -> Moments:
    """Moments of all windows beside a fitted model.

    Parameters
    ----------
    white : mapping of int to (c, R_j) float64
        the whitened torque
    windows : mapping of int to (g, R_j) sparse array
        the windows
    """
    target, inner, gram = 0.0, 0.0, 0.0
    for joint, rows in white.items():
        window, squared = windows[joint], windows[joint].power(2)
        basis, residual = fit.projection.basis[joint], fit.projection.residual[joint]
        target = target + window @ (rows * residual).T
        inner = inner + np.stack([window @ (row * basis).T for row in rows], axis=1)
        gram = gram + np.stack([squared @ (row * rows).T for row in rows], axis=1)
    raw, inner = np.asarray(gram), np.asarray(inner)
    projected = raw - inner @ inner.swapaxes(1, 2)
    energy = np.einsum("gcc->gc", raw)
    shares = np.einsum("gcc->gc", projected) / np.where(energy > 0.0, energy, 1.0)
    return Moments(np.asarray(target), projected, np.clip(shares, 0.0, 1.0), inner)


def windows_tried(
    found: Moments, white: Mapping[int, Array], windows: Windows, fit: Fit, rng: np.random.Generator
) -> float:
    """Effective number of windows, at least 1: as of a grid of shapes, from draws of white noise.

    Parameters
    ----------
    white : mapping of int to (c, R_j) float64
        the whitened torque
    windows : mapping of int to (g, R_j) sparse array
        the windows
    """
    shapes, count = found.target.shape
    projected = np.zeros((fit.projection.spread.shape[1], DRAWS))
    scores = np.zeros((shapes, count, DRAWS))
    for joint, basis in enumerate(fit.projection.basis):
        noise = rng.standard_normal((basis.shape[1], DRAWS), dtype=np.float32)  # half of the memory's time
        projected += basis.astype(np.float32) @ noise
        if joint in white:
            window = windows[joint].astype(np.float32)
            for place, row in enumerate(white[joint].astype(np.float32)):
                scores[:, place] += window @ (row[:, None] * noise)
    scores -= np.einsum("gcr,rd->gcd", found.inner, projected)
    visible = (found.shares > INVISIBLE).all(axis=1)
    if not visible.any():
        return 1.0
    inverse = np.linalg.pinv(found.gram[visible], rcond=1e-9, hermitian=True)
    own = scores[visible]
    largest = np.einsum("gcd,gce,ged->gd", own, inverse, own, optimize=True).max(axis=0)
    single = float(stats.chi2.sf(np.quantile(largest, 1.0 - TAIL), count))
    return float(np.clip(-np.log1p(-TAIL) / max(single, 1e-12), 1.0, visible.sum()))
