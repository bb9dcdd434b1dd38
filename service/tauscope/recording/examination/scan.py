"""All samples of a recording that are none, found block by block."""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.examination import scales
from tauscope.recording.examination.edits import NO_NUMBERS, ColumnEdit, Numbers, Rows, join_ranges, row_numbers
from tauscope.recording.examination.effort_defects import ZeroRuns, find_all_stuck, find_spikes, find_stuck
from tauscope.recording.examination.position_defects import scan_position
from tauscope.recording.recording import Recording, Samples
from tauscope.recording.samples import Array
from tauscope.robot.robot import JointType

SPARE_ROWS = 512  # rows read beyond a block on either side: a run of one value that is longer is taken to end there
ON_A_LINE = 31  # rows of which a quarter or more came in time, and none before it
OFF_THE_LINE = 0.5  # share of the usual interval by which the stamp of one that waited is off
REST_HOLDS = 4  # holds of one value after which it is a rest, and no update that was lost


@dataclass(eq=False)
class JointDefects:
    """Defects of one joint's samples."""

    hold: int  # rows for which the position is held; 1 where it is not
    effort_hold: int  # the same of the effort
    # of spikes, frozen, repeated positions; of zeros, stuck, effort_spikes: (m,) int64, ascending
    rows: dict[str, Numbers] = field(default_factory=lambda: defaultdict(lambda: NO_NUMBERS))
    jumps: list[tuple[int, float]] = field(default_factory=list)  # first row behind each, and its height [rad or m]
    wraps: list[tuple[int, float]] = field(default_factory=list)  # as `jumps`

    def position_edit(self, count: int, lost: Numbers) -> ColumnEdit:
        """Edit of a position of `count` rows, further rows `lost` (m,): jumps count from the longest piece."""
        where, offsets = NO_NUMBERS, np.empty(0)
        if self.jumps or self.wraps:
            where = np.unique([0, *(row for row, _ in (*self.jumps, *self.wraps))])
            # Whole turns matter to nobody: the longest piece is that between jumps.
            offsets = _sum_jumps(self.jumps, where, count) + _sum_jumps(self.wraps, where, count)
        return ColumnEdit(self._ranges("spikes", "frozen", "repeated", lost=lost), jumps=where, offsets=offsets)

    @property
    def lost_efforts(self) -> Rows:
        """Ranges of rows without a measured effort, (k, 2)."""
        return self._ranges("zeros", "stuck", "effort_spikes")

    def _ranges(self, *kinds: str, lost: Numbers = NO_NUMBERS) -> Rows:
        return join_ranges(np.unique(np.concatenate([lost, *(self.rows[kind] for kind in kinds)])))


@dataclass(eq=False)
class Defects:
    """Defects of a recording's samples."""

    joints: list[JointDefects]
    alternate: bool  # whether positions and efforts come in rows of their own
    bunched: Numbers = field(default_factory=lambda: NO_NUMBERS)  # (m,) int64, rows whose stamp is that of a neighbour


def find_defects(recording: Recording, types: list[JointType]) -> Defects:
    """Find a recording's defects in memory that grows with their number only."""
    sketch = scales.Sketch.of(recording)
    positions, efforts = scales.measure_positions(sketch, types), scales.measure_efforts(sketch)
    joints = [JointDefects(q.hold, tau.hold) for q, tau in zip(positions, efforts, strict=True)]
    has_effort, has_position = np.isfinite(sketch.effort).any(axis=1), np.isfinite(sketch.position).all(axis=1)
    alternate = bool(has_effort.any() and has_position.any() and not (has_effort & has_position).any())
    scan = _Scan(sketch, positions, efforts, Defects(joints, alternate), ZeroRuns(efforts))
    count = len(recording)
    for start in range(0, count, scales.BLOCK_ROWS):
        stop = min(start + scales.BLOCK_ROWS, count)
        first = max(start - SPARE_ROWS, 0)
        scan.add(recording.samples(first, min(stop + SPARE_ROWS, count)), first, (start, stop))
        scan.zeros.add(recording.samples(start, stop), start)
    return scan.finish(recording)


@dataclass(eq=False)
class _Scan:
    """One walk through a recording."""

    sketch: scales.Sketch
    positions: list[scales.PositionScale]
    efforts: list[scales.EffortScale]
    defects: Defects
    zeros: ZeroRuns
    found: dict[tuple[int, str], list[Numbers]] = field(default_factory=dict)

    def add(self, samples: Samples, first: int, core: tuple[int, int]) -> None:
        """Take a block, of which the rows of `core` are its own and the others neighbours."""
        rows = np.arange(first, first + len(samples.time))
        close = np.zeros(len(samples.time), dtype=np.bool_)
        if not self.sketch.has_bursts:
            close = _find_bunched(samples.time, self.sketch.interval)
        self._keep(0, "bunched", rows[close], core)
        stuck = find_all_stuck(rows, samples.effort, samples.position, self.efforts)
        for joint, (place, scale) in enumerate(zip(self.defects.joints, self.positions, strict=True)):
            self._keep(joint, "stuck", stuck, core)
            position = np.ascontiguousarray(samples.position[:, joint])
            known = np.isfinite(position) & ~close
            if place.hold > 1:
                known[known] = scales.is_new(position[known])
            interval = self.sketch.interval * place.hold
            for kind, row, height in scan_position(
                rows[known], samples.time[known], position[known], scale, interval, core
            ):
                if kind in ("jumps", "wraps"):
                    getattr(place, kind).append((row, height))
                else:
                    self._keep(joint, kind, np.array([row]), (0, core[1]))
            if place.hold > 1:
                same = np.concatenate([[False], position[1:] == position[:-1]])
                self._keep(joint, "repeated", rows[_find_repeated(same, place.hold)], core)
            effort, measure = np.ascontiguousarray(samples.effort[:, joint]), self.efforts[joint]
            known = np.isfinite(effort) & (effort != 0.0)  # zeros are looked at elsewhere
            if known.any():
                self._keep(joint, "effort_spikes", find_spikes(rows[known], effort[known], measure), core)
                self._keep(
                    joint, "stuck", find_stuck(rows[known], effort[known], samples.position[known], measure), core
                )

    def finish(self, recording: Recording) -> Defects:
        defects = self.defects
        for (joint, name), parts in self.found.items():
            rows = np.unique(np.concatenate(parts))
            if name == "bunched":
                defects.bunched = rows
            else:
                defects.joints[joint].rows[name] = rows
        for joint, ranges in zip(defects.joints, self.zeros.find_dropouts(recording), strict=True):
            joint.rows["zeros"] = np.unique(row_numbers(ranges))
        return defects

    def _keep(self, joint: int, name: str, rows: Numbers, core: tuple[int, int]) -> None:
        own = rows[(rows >= core[0]) & (rows < core[1])]
        if len(own):
            self.found.setdefault((joint, name), []).append(own)


def _sum_jumps(jumps: list[tuple[int, float]], where: Numbers, count: int) -> Array:
    """Sum of the jumps up to each row of `where`, (m,); 0 in the longest piece between them."""
    ordered = sorted(jumps)
    starts = np.array([0, *(row for row, _ in ordered)], dtype=np.int64)
    heights = np.cumsum([0.0, *(height for _, height in ordered)])
    heights -= heights[int(np.argmax(np.diff(np.append(starts, count))))]
    return heights[np.searchsorted(starts, where, side="right") - 1]


def _find_bunched(time: Array, interval: float) -> NDArray[np.bool_]:
    """Rows whose stamp is no instant of theirs: off the line of their neighbours where several came together.

    They waited for the last one. Of two that are still at one instant, the second is one too many.
    """
    is_close = np.diff(time, prepend=-np.inf) < scales.BUNCHED * interval
    if not is_close.any():
        return is_close
    offset, waited = time - interval * np.arange(len(time)), np.zeros(len(time), dtype=np.bool_)
    near = np.flatnonzero(_surround(is_close).max(axis=1))
    line = np.percentile(_surround(offset)[near], 25.0, axis=1)
    waited[near] = np.abs(offset[near] - line) > OFF_THE_LINE * interval
    kept = np.flatnonzero(~waited)
    waited[kept] = np.diff(time[kept], prepend=-np.inf) < scales.BUNCHED * interval
    return waited


def _surround(values: NDArray[Any]) -> NDArray[Any]:
    """Every value with its neighbours, (N, `ON_A_LINE`)."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, ON_A_LINE // 2, "edge"), ON_A_LINE)


def _find_repeated(same: NDArray[np.bool_], hold: int) -> NDArray[np.bool_]:
    """Rows that repeat a held value; of a rest of `REST_HOLDS` or more one row in `hold` is kept."""
    number = np.arange(len(same))
    since = number - np.maximum.accumulate(np.where(same, 0, number))
    return same & ((since % hold != 0) | (since < REST_HOLDS * hold))
