"""Positions that no encoder measured: spikes, frozen values, and jumps by a constant."""

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from tauscope.recording.examination.edits import Numbers
from tauscope.recording.examination.scales import ONE_TURN, PositionScale, neighbours_median, unwrap_steps
from tauscope.recording.samples import Array

SURPRISE = 20.0  # multiple of the usual surprise above which a step is looked at: 26 standard deviations of noise
# Share of the largest usual step above which it is: motion has small surprises where noise has none.
SHARE_OF_MOVE = 0.1
STEPS = 5.0  # encoder steps above which it is: one or two are its rounding
# Rows after which a position is back, where it was a spike; the second where it went as far as a jump.
LONGEST_SPIKE, LONGEST_GLITCH = 5, 32
RETURN = 0.3  # largest difference between the way out and the way back of a spike, relative to them
JUMP = 5.0  # multiple of the way at the largest usual speed that a jump exceeds; a joint that hits an end stop does not
LEAST_JUMP = 0.01  # smallest jump that is called one [rad or m]
# Largest error of the step after frozen rows, relative to the motion by the lower speed: a rest hides none.
MAKES_UP = 0.6
CHANGES = 3  # changes on either side of frozen rows from which the speed is taken


class PositionDefect(NamedTuple):
    """A row whose position was never measured, or the first row behind a jump, and its height [rad or m]."""

    kind: Literal["spikes", "frozen", "jumps", "wraps"]
    row: int
    height: float = 0.0


def scan_position(
    rows: Numbers, time: Array, position: Array, scale: PositionScale, interval: float, core: tuple[int, int]
) -> Iterator[PositionDefect]:
    """Defects of one joint's known `position`, (N,), with its `rows` and `time`, (N,); `core`: rows to answer for."""
    if len(position) < 8:
        return
    plain = np.diff(position)
    steps = unwrap_steps(plain, is_wrapped=scale.is_wrapped)
    is_core = (rows[1:] >= core[0]) & (rows[1:] < core[1])
    for k in np.flatnonzero((plain != steps) & is_core):
        yield PositionDefect("wraps", int(rows[k + 1]), float(ONE_TURN * np.rint((plain[k] - steps[k]) / ONE_TURN)))
    least = max(SURPRISE * scale.surprise, STEPS * scale.step, SHARE_OF_MOVE * scale.move)
    if least == 0.0 or np.abs(steps).max() <= least:
        return
    surprise = steps - neighbours_median(steps)
    large = np.flatnonzero((np.abs(surprise) > least) & (steps != 0.0))  # a rest is judged by the step that ends it
    # Across a gap in time a joint may go as far as its speed allows.
    least_jump = np.maximum(JUMP * scale.move * np.maximum(np.diff(time) / interval, 1.0), LEAST_JUMP)
    calm = np.where(np.abs(steps) > least_jump, 0.0, steps)
    index = 0
    while index < len(large):
        a = int(large[index])
        frozen = _count_frozen(steps, calm, a)
        is_jump = abs(surprise[a]) > least_jump[a]
        reach = a + (LONGEST_GLITCH if is_jump else LONGEST_SPIKE)
        later = [int(b) for b in large[index + 1 : index + 4] if b <= reach and not frozen]
        partner = next((b for b in later if _returns(surprise, a, b)), None)
        index += 1
        if frozen and is_core[a]:
            yield from (PositionDefect("frozen", int(row)) for row in rows[a - frozen + 1 : a + 1])
        elif partner is not None:
            spikes = (int(row) for row in rows[a + 1 : partner + 1] if core[0] <= row < core[1])
            yield from (PositionDefect("spikes", row) for row in spikes)
            index = int(np.searchsorted(large, partner)) + 1
        elif is_core[a] and is_jump:
            yield PositionDefect("jumps", int(rows[a + 1]), float(surprise[a]))


def _returns(surprise: Array, a: int, b: int) -> bool:
    out, back = float(surprise[a]), float(surprise[b])
    return abs(out + back) < RETURN * max(abs(out), abs(back))


def _count_frozen(steps: Array, calm: Array, k: int) -> int:
    """Repeated rows before a step that makes up for them at speeds of `calm`, steps without jumps; else 0."""
    before, after = np.flatnonzero(steps[:k])[-CHANGES:], k + 1 + np.flatnonzero(steps[k + 1 :])[:CHANGES]
    if not len(before) or not len(after) or before[-1] == k - 1:
        return 0
    rest = k - 1 - int(before[-1])
    # A coarse encoder's position changes in few rows: a speed is that of several changes.
    speeds = calm[before[0] : before[-1] + 1].mean(), calm[k + 1 : after[-1] + 1].mean()
    hidden = (rest + 1) * np.array(speeds)
    return rest if abs(steps[k] - hidden.mean()) <= MAKES_UP * np.abs(hidden).min() else 0
