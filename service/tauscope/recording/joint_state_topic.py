"""From the JointState messages of one topic to a recording: which joints, which clock."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.columns import table_columns
from tauscope.recording.intake import RowIntake
from tauscope.recording.joint_state import JointState, JointStateLayout, JointStates, decode_cdr, decode_json
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.table import SPOOL_ABOVE_BYTES
from tauscope.recording.units import SI, Reading
from tauscope.recording.words import listed, reason
from tauscope.result_warning import ResultWarning

_MESSAGES_AT_ONCE = 4096

LONGEST_FROM_ZERO_NS = 10**12
"""A stamp of zero beside stamps above this is none [ns]; simulated time may begin at zero."""

Decoded = TypeVar("Decoded")


@dataclass(frozen=True)
class Choice:
    """What the user wants out of a log.

    joint_count : int or None
        joints that the recording must have; None where any number is welcome
    spool_above_bytes : int
        size above which the rows go to a temporary file [bytes]
    """

    file: str
    joint_count: int | None = None
    joint_names: tuple[str, ...] | None = None
    spool_above_bytes: int = SPOOL_ABOVE_BYTES
    reading: Reading = SI


class JointStateTopic:
    """Collects the messages of one topic; a fault is kept until it is known whether this topic is the wanted one."""

    def __init__(self, topic: str, encoding: str, choice: Choice) -> None:
        """Start empty."""
        self.topic = topic
        self.messages = 0
        self.fault: RecordingError | None = None
        self._is_cdr = encoding == "cdr"
        self._choice = choice
        self._layout: JointStateLayout | None = None
        self._pending: list[tuple[int, bytes]] = []
        self._rows: _Rows | None = None
        self._skipped_names: tuple[str, ...] = ()

    def add(self, log_time: int, message: bytes) -> None:
        """Take the next message.

        Parameters
        ----------
        log_time : int
            when it was logged [ns]
        """
        self.messages += 1
        if self.fault is None:
            self._pending.append((log_time, message))
            if len(self._pending) >= _MESSAGES_AT_ONCE:
                self.flush()

    def flush(self) -> None:
        """Decode what was taken and not yet decoded."""
        pending, self._pending = self._pending, []
        if not pending or self.fault is not None:
            return
        first = self.messages - len(pending) + 1
        try:
            for start, states in self._decode([message for _, message in pending], first):
                times = [time for time, _ in pending[start : start + len(states.stamp)]]
                self._take(states, np.array(times, dtype=np.uint64).astype(np.int64), first + start)
        except RecordingError as error:
            self.fault = error

    @property
    def samples(self) -> int:
        """Number of samples collected so far."""
        return 0 if self._rows is None else len(self._rows)

    def finish(self) -> Recording:
        """The recording that this topic holds.

        Raises
        ------
        RecordingError
            names the message at fault, counted from 1 within the topic
        """
        self.flush()
        if self.fault is not None:
            raise self.fault
        if self._rows is None:
            wanted, found = self._choice.joint_names or (), self._skipped_names
            raise RecordingMismatchError(
                f"{self._choice.file}: topic {self.topic} carries {len(found)} joints ({listed(found)}), "
                f"the robot has {len(wanted)} ({listed(wanted)}); give the robot file of the recorded arm"
            )
        return self._rows.finish()

    def _decode(self, messages: Sequence[bytes], first: int) -> Iterable[tuple[int, JointStates]]:
        """Batches of equal layout and where they start; all at once where the publisher kept to one layout."""
        if self._is_cdr:
            if self._layout is None:
                self._layout = self._decode_one(JointStateLayout, messages[0], first)
            if (states := self._layout.decode(messages)) is not None:
                return [(0, states)]
        decode = decode_cdr if self._is_cdr else decode_json
        decoded = [self._decode_one(decode, message, first + index) for index, message in enumerate(messages)]
        runs = groupby(enumerate(decoded), key=lambda entry: _layout_of(entry[1]))
        return [(run[0][0], _stack([state for _, state in run])) for run in (list(group) for _, group in runs)]

    def _decode_one(self, decode: Callable[[bytes], Decoded], message: bytes, number: int) -> Decoded:
        """`decode(message)`, its complaint turned into one that names the message."""
        try:
            return decode(message)
        except (ValueError, OverflowError) as error:
            raise RecordingError(
                f"{self._choice.file}: topic {self.topic}, message {number}: not a JointState message ({reason(error)})"
            ) from error

    def _take(self, states: JointStates, log_time: NDArray[np.int64], number: int) -> None:
        """Add a batch to the rows, in the order of the wanted joints."""
        place = f"{self._choice.file}: topic {self.topic}, message {number}"
        _require_complete(states, place)
        wanted = self._rows.joint_names if self._rows is not None else self._choice.joint_names
        order = _joint_order(states.names, states.position.shape[1], wanted, place)
        if order is None:
            self._skipped_names = states.names
            return
        if self._rows is None:
            names = tuple(states.names[index] for index in order) if states.names else None
            self._rows = _Rows(self._choice, self.topic, names, len(order), has_velocity=states.velocity.shape[1] > 0)
        self._rows.append(states, order, log_time, number)


class _Rows:
    """The rows of one topic: relative time, positions, efforts and, where they are sent, velocities."""

    def __init__(
        self, choice: Choice, topic: str, joint_names: tuple[str, ...] | None, joint_count: int, *, has_velocity: bool
    ) -> None:
        self.joint_names = joint_names
        self._name, self._topic = choice.file, topic
        self._joint_count, self._has_velocity = joint_count, has_velocity
        columns = table_columns(joint_count, EffortKind.TORQUE, ("qd",) if has_velocity else ())
        spool = choice.spool_above_bytes
        self._intake = RowIntake(choice.file, columns, EffortKind.TORQUE, choice.reading, spool_above_bytes=spool)
        self._origin: int | None = None
        self._by_log_time = False
        self._unset = 0

    def __len__(self) -> int:
        return len(self._intake)

    def append(self, states: JointStates, order: Sequence[int], log_time: NDArray[np.int64], number: int) -> None:
        """Add messages; the clock is the header stamp, or the log's where the first batch has no stamps at all."""
        if (states.velocity.shape[1] > 0) != self._has_velocity:
            raise RecordingError(
                f"{self._name}: topic {self._topic}, message {number}: velocities are sent in some messages only; "
                "record again with one publisher"
            )
        stamp = states.stamp
        unset = (stamp == 0) & (stamp.max() > LONGEST_FROM_ZERO_NS)
        if (
            unset.any() and not self._by_log_time
        ):  # what the log's clock is ahead of the publisher's, it is for these messages, too
            ahead = np.median((log_time - stamp)[~unset]).astype(np.int64)
            stamp = np.where(unset, log_time - ahead, stamp)
            self._unset += int(unset.sum())
        if self._origin is None:
            self._by_log_time = not stamp.any()
            self._origin = int(log_time[0] if self._by_log_time else stamp[0])
        elif self._by_log_time and stamp.any():
            raise RecordingError(
                f"{self._name}: topic {self._topic}, message {number + int(np.argmax(stamp != 0))}: "
                "has a time stamp where the messages before it have none"
            )
        clock = log_time if self._by_log_time else stamp
        time = (clock - self._origin).astype(np.float64) * 1e-9
        parts = [time[:, None], states.position[:, order], states.effort[:, order]]
        block = np.hstack([*parts, states.velocity[:, order]] if self._has_velocity else parts)
        self._intake.add(block, lambda row: f"topic {self._topic}, message {number + row}")

    def finish(self) -> Recording:
        recording = self._intake.finish(self._joint_count)
        if not self._unset:
            return recording
        messages = "1 message has" if self._unset == 1 else f"{self._unset} messages have"
        note = ResultWarning(
            code="time-stamps",
            text=f"column t: {messages} no stamp; the time at which they were logged was taken",
            remedy="stamp every message",
        )
        return replace(recording, notes=(*recording.notes, note))


def _layout_of(state: JointState) -> tuple[tuple[str, ...], int, int, int]:
    """Messages that agree in this can be stacked."""
    return state.names, len(state.position), len(state.velocity), len(state.effort)


def _stack(states: Sequence[JointState]) -> JointStates:
    """Messages of one layout as one batch."""
    stamp = np.array([state.stamp for state in states], dtype=np.int64)
    fields = ("position", "velocity", "effort")
    return JointStates(stamp, states[0].names, *(np.array([getattr(s, field) for s in states]) for field in fields))


def _require_complete(states: JointStates, place: str) -> None:
    """Every joint has a position and an effort, and a velocity where any has."""
    joints = states.position.shape[1]
    if states.names and len(states.names) != joints:
        raise RecordingError(f"{place}: {len(states.names)} joint names and {joints} positions")
    if not joints:
        raise RecordingError(f"{place}: carries no positions")
    if not states.effort.shape[1]:
        raise RecordingError(f"{place}: carries no effort; record the torques or currents of the joints too")
    for field, count in (("efforts", states.effort.shape[1]), ("velocities", states.velocity.shape[1] or joints)):
        if count != joints:
            raise RecordingError(f"{place}: {joints} positions and {count} {field}")
    if len(set(states.names)) != len(states.names):
        raise RecordingError(f"{place}: a joint is named twice ({listed(states.names)})")


def _joint_order(
    names: tuple[str, ...], count: int, wanted: tuple[str, ...] | None, place: str
) -> Sequence[int] | None:
    """Index of each wanted joint in a message; None where the message is about other joints (a gripper's, say)."""
    if wanted is None or not names:
        if wanted is not None and count != len(wanted):
            return None
        return range(count)
    missing = [name for name in wanted if name not in names]
    if not missing:
        return [names.index(name) for name in wanted]
    if len(missing) < len(wanted):
        raise RecordingMismatchError(
            f"{place}: joint {listed(missing)} is missing (the message names {listed(names)}); "
            "name the robot's joints as the recording does"
        )
    return range(count) if count == len(wanted) else None
