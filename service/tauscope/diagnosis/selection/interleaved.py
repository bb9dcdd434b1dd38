"""Whether what happens once is there: nothing that was held out can say so, but every other moment of it can.

The rows within the window are cut into short blocks. The coefficients that every other block asks for have to predict
the blocks between, both ways round; and so have those of the window's first half its second. The effect has to be most
of what is wrong within its window, and the model that is left may not predict held-out motion worse: a window on
something else explains a part of it only, or not all along, or at the cost of the other parameters. A joint that stands
still is no witness: its friction may be anything, and whatever it is looks like a contact for as long as it stands.
"""

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.selection.confirmation import CLEARLY_WORSE, Confirmation, HeldOut, likeness
from tauscope.recording.recording import Array

NOT_THERE = Confirmation(0.0, -np.inf, np.inf, 0.0, -np.inf)

STILL = 0.05
"""Speed of a joint, relative to its rms, below which it stands."""

MOSTLY = 0.5
"""Part of the effect's energy that lies at joints that move, at least."""

BLOCKS = 10
"""Blocks that a window is cut into."""

SHORTEST_S = 0.1
LONGEST_S = 1.0

OPEN = 1e-3
"""Part of its largest row from which a row of the effect counts as inside the window."""

MOST_OF_IT = 0.5
"""Part of the excess within the window that the effect explains at least."""


def interleaved_confirmation(
    term: Term, before: Fit, after: Fit, screen: Screen, held_out: HeldOut | None = None
) -> Confirmation:
    """Confirm an effect of bounded duration within its own window."""
    observations, signals = screen.observations, model_signals(before.model, screen.observations)
    white = screen.white_columns(term.effect, term.shape[None], signals)
    # errors that all rows share carry a little of the window to every row
    bare = Screen(observations.with_weightings(()), ()).white_columns(term.effect, term.shape[None], signals)
    columns: list[Array] = []
    residual: list[Array] = []
    blocks: list[NDArray[np.intp]] = []
    late: list[NDArray[np.intp]] = []
    left, excess, seen, whole = 0.0, 0.0, 0.0, 0.0
    for joint, rows in white.items():
        own = rows[0]
        strength = np.abs(bare[joint][0]).max(axis=0)
        inside = strength > OPEN * max(float(strength.max()), np.finfo(float).tiny)
        whole += float(np.sum(own[:, inside] ** 2))
        inside &= _moves(observations, joint)
        seen += float(np.sum(own[:, inside] ** 2))
        if not inside.any():
            continue
        recording, instants = observations.row_labels(joint)
        block = _block_numbers(recording[inside], instants[inside])
        columns.append(own[:, inside])
        residual.append(before.projection.residual[joint][inside])
        blocks.append(block)
        late.append(_second_half(recording[inside], instants[inside]))
        excess += float(residual[-1] @ residual[-1]) - inside.sum()
        left += float(np.sum(after.projection.residual[joint][inside] ** 2)) - inside.sum()
    if not columns or seen < MOSTLY * whole or left > (1.0 - MOST_OF_IT) * excess:
        return NOT_THERE
    given = np.concatenate(columns, axis=1), np.concatenate(residual), np.concatenate(blocks)
    halves = np.concatenate(late)
    both = [_predicted(*given, folds) for folds in (given[2] % 2, halves)]
    if held_out is not None:
        gains = held_out.block_gains(before.model, after.model)
        spread = float(gains.std(ddof=1) * np.sqrt(len(gains))) if len(gains) > 1 else np.inf
        if gains.sum() < CLEARLY_WORSE * spread:
            return NOT_THERE
    return min(both, key=lambda each: each.gain_z)


def _moves(observations: Observations, joint: int) -> NDArray[np.bool_]:
    """Whether a joint moves, at each of its whitened rows."""
    order = observations.noise[joint].order
    rows = [piece.reduced(np.abs(piece.prepared.motion.velocity[None, :, joint]))[0] for piece in observations]
    speed = np.concatenate([each[order:] for each in rows])[observations.kept(joint)]
    return speed > STILL * np.sqrt(np.mean(speed**2))


def _block_numbers(recording: NDArray[np.intp], instants: Array) -> NDArray[np.intp]:
    """Consecutive numbers of short blocks, the same instants in the same block at every joint."""
    span = float(np.ptp(instants))
    length = float(np.clip(span / BLOCKS, SHORTEST_S, LONGEST_S))
    number = np.floor((instants - instants.min()) / length).astype(np.intp)
    return number + 2 * (int(number.max()) // 2 + 1) * recording  # even, so that folds alternate in every recording


def _second_half(recording: NDArray[np.intp], instants: Array) -> NDArray[np.intp]:
    """1 in the second half of the window of every recording, 0 in the first."""
    found = np.zeros(len(instants), dtype=np.intp)
    for number in np.unique(recording):
        own = recording == number
        found[own] = instants[own] > 0.5 * (instants[own].min() + instants[own].max())
    return found


def _predicted(columns: Array, residual: Array, blocks: NDArray[np.intp], folds: NDArray[np.intp]) -> Confirmation:
    """Coefficients of one fold against the rows of the other, both ways round; spread by blocks."""
    gains: list[Array] = []
    expected, along = 0.0, 0.0
    for fold in (0, 1):
        taught, asked = folds == fold, folds != fold
        if not (taught.any() and asked.any()):
            return NOT_THERE
        coefficients = np.linalg.lstsq(columns[:, taught].T, residual[taught], rcond=1e-9)[0]
        prediction = coefficients @ columns[:, asked]
        gain = residual[asked] ** 2 - (residual[asked] - prediction) ** 2
        _, inverse = np.unique(blocks[asked], return_inverse=True)
        gains.append(np.bincount(inverse, gain).astype(np.float64))
        expected += float(prediction @ prediction)
        along += float(prediction @ residual[asked])
    sums = np.concatenate(gains)
    spread = float(sums.std(ddof=1) * np.sqrt(len(sums))) if len(sums) > 1 else np.inf
    strength = float(np.sqrt(expected))
    total = float(sums.sum())
    smallest = np.finfo(float).tiny
    seen = along / max(strength, smallest)
    return Confirmation(total, total / max(spread, smallest), strength, seen, likeness(strength, seen))
