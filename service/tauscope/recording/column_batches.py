"""Recordings from files of whole columns, such as Parquet and NumPy archives, batch by batch."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from tauscope.recording.columns import ColumnLayout, find_layout, require_joint_count
from tauscope.recording.intake import EpisodeClock, RowIntake, SplitClock
from tauscope.recording.recording import Array, Recording
from tauscope.recording.table import SPOOL_ABOVE_BYTES
from tauscope.recording.units import SECONDS, SI, Reading

ROWS_AT_ONCE = 2**16
_EPISODE = "episode_index"

Batch = Callable[[str], Array]  # values of a column of the file, (rows,) float64


def read_batches(
    name: str,
    header: Sequence[str],
    rows: int,
    open_batches: Callable[[ColumnLayout, Sequence[str]], Iterable[Batch]],
    *,
    joint_count: int | None = None,
    spool_above_bytes: int = SPOOL_ABOVE_BYTES,
    reading: Reading = SI,
    first_row: int = 0,
    has_episodes: bool = False,
) -> Recording:
    """Find the wanted columns and take all rows.

    Raises RecordingError, which names the row and column at fault. Raises RecordingMismatchError where the file has
    another number of joints.

    `rows`: expected number.
    `open_batches`: the batches of the columns that it is told to read.
    `first_row`: number of the file's first row in messages.
    `has_episodes`: whether a column `episode_index` splits the rows into episodes, each on a clock of its own.
    """
    reading, layout = find_layout(header, reading, name)
    require_joint_count(layout.joint_count, joint_count, name)
    wanted = [header[index] for index in layout.source]
    nanoseconds = None if layout.nanoseconds is None else header[layout.nanoseconds]
    episodes = None
    if has_episodes and _EPISODE in header:
        episodes = EpisodeClock(SECONDS.get(reading.units.get("t", "s"), 1.0))
    further = [*([] if nanoseconds is None else [nanoseconds]), *([_EPISODE] if episodes else [])]
    batches = open_batches(layout, [*wanted, *further])  # before there is memory for rows, which it may refuse
    intake = RowIntake(name, layout.names, layout.effort_kind, reading, rows, spool_above_bytes)
    split = SplitClock()
    for take in batches:
        block, first = np.column_stack([take(column) for column in wanted]), first_row + len(intake)
        if nanoseconds is not None:
            block[:, 0] = split.join(block[:, 0], take(nanoseconds))
        if layout.counts_rows:
            block[:, 0] = np.arange(len(block)) + len(intake)
        elif episodes is not None:
            block[:, 0] = episodes.shift(block[:, 0], take(_EPISODE))
        intake.add(block, lambda row, first=first: f"row {first + row}")
    return intake.finish(layout.joint_count, layout.ignored, (*layout.notes, *(episodes.notes if episodes else ())))
