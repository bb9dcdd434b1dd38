"""Which messages of a topic are of the arm's own publisher."""

from collections import Counter
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.recording.joint_state import JointStates
from tauscope.recording.layout.rename import mismatch
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import listed

Rows: TypeAlias = NDArray[np.intp]
# Messages of one layout, and their places among those that were taken at once.
Batch: TypeAlias = tuple[Rows, JointStates]

_SECOND = "second"  # what a complete message of another publisher lacks
LEAP = 3.0  # distance between two publishers' lines, in bends of either, from which each has a state of its own
_REMEDY = "record with one publisher on the topic, or choose another topic with --topic"


class OtherPublishers:
    """Counts a topic's messages of others, by what they lack, and their names; "" where they lack joints."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, tuple[str, ...]]] = Counter()
        self._foreign: dict[tuple[str, ...], bool] = {}  # by the order in which a publisher names the joints

    def add(self, names: Sequence[str], missing: str, count: int) -> None:
        """Messages without joints that are wanted (""), without positions, or without efforts."""
        self._counts[missing, tuple(names)] += count

    def leave_out(self, batches: Sequence[Batch], orders: Sequence[tuple[str, ...]]) -> list[Batch]:
        """Batches without those of a second publisher. `orders`: names of the joints as each batch had them.

        One that changes the order goes on from where the arm was; another has a state of its own, and the arm leaps
        to and fro between the two.
        """
        new = [order for order in dict.fromkeys(orders) if order not in self._foreign]
        for order in new:
            self._foreign[order] = bool(self._foreign) and _leaps(batches, [each == order for each in orders])
        for (rows, _), order in zip(batches, orders, strict=True):
            if self._foreign[order]:
                self._counts[_SECOND, order] += len(rows)
        return [batch for batch, order in zip(batches, orders, strict=True) if not self._foreign[order]]

    def notes(self, topic: str, wanted: Sequence[str]) -> tuple[ResultWarning, ...]:
        """Warnings about messages that name wanted joints; a gripper's own messages are none of the arm's business."""
        texts = [
            f"{_messages(count)} {_held(missing, names)}; left out"
            for (missing, names), count in sorted(self._counts.items(), key=lambda entry: not entry[0][0])
            if (missing and not names) or set(names) & set(wanted)
        ]
        return tuple(
            ResultWarning(code="other-publisher", text=f"topic {topic}: {text}", remedy=_REMEDY) for text in texts
        )

    def error(self, place: str, wanted: Sequence[str] | None) -> RecordingError:
        """The reason why no message was of use."""
        for missing, _ in self._counts:
            if missing:
                return RecordingError(f"{place}: carries no {missing}; record position and effort of every joint")
        known = wanted or ()
        partial = dict.fromkeys(name for _, names in self._counts if set(names) & set(known) for name in names)
        found = tuple(partial) or max(self._counts, key=lambda entry: self._counts[entry], default=("", ()))[1]
        return mismatch(f"{place} carries", found, known)


def _messages(count: int) -> str:
    return "1 message holds" if count == 1 else f"{count} messages hold"


def _held(missing: str, names: Sequence[str]) -> str:
    if missing == _SECOND:
        return "another state of the same joints"
    return f"no {missing}" if missing else f"only the joints {listed(names)}"


def _leaps(batches: Sequence[Batch], is_other: Sequence[bool]) -> bool:
    """Whether one publisher's positions are farther from the other's line in time than from their own."""
    times, paths = [], []
    for flag in (False, True):
        own = [batch for batch, other in zip(batches, is_other, strict=True) if other == flag]
        time = np.concatenate([states.stamp if states.stamp.any() else rows for rows, states in own])
        order = np.argsort(time)
        times.append(time[order].astype(float))
        paths.append(np.concatenate([states.position for _, states in own])[order])
    if min(map(len, times)) < 3:
        return False
    line = np.column_stack([np.interp(times[1], times[0], column) for column in paths[0].T])
    bends = [np.abs(np.diff(path, 2, axis=0)).max(axis=1) for path in paths]
    return bool(np.median(np.abs(paths[1] - line).max(axis=1)) > LEAP * np.median(np.concatenate(bends)))
