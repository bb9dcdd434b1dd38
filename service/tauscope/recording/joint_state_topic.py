"""From the topics of a log to a recording: which topic is meant, which joints, which clock."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.recording.columns import table_columns
from tauscope.recording.inflation import (
    HELD_BYTES,
    LARGEST_MESSAGE_BYTES,
    decompress_message,
    require_plausible_inflation,
)
from tauscope.recording.intake import Choice, RowIntake
from tauscope.recording.joint_parts import JointParts, merge_parts
from tauscope.recording.joint_state import JointState, JointStateLayout, JointStates, decode_cdr
from tauscope.recording.joint_state_decoders import Decoder, find_decoder
from tauscope.recording.publishers import Batch, OtherPublishers, Rows
from tauscope.recording.recording import EffortKind, Recording
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import listed, reason

_MESSAGES_AT_ONCE = 4096
_BYTES_AT_ONCE = 2**24

LONGEST_FROM_ZERO_NS = 10**12  # a stamp of zero beside stamps above this is none [ns]; simulated time may begin at zero
Decoded = TypeVar("Decoded")


class JointStateTopic:
    """Collects the messages of one topic; a fault is kept until it is known whether this topic is the wanted one."""

    def __init__(self, topic: str, decoder: Decoder, choice: Choice) -> None:
        self.topic = topic
        self.messages = 0
        self.fault: RecordingError | None = None
        self._decoder = decoder
        self._choice = choice
        self._layouts: dict[int, JointStateLayout] = {}
        self._pending: list[tuple[int, bytes]] = []
        self._pending_bytes = self._unpacked_bytes = 0
        self._rows: _Rows | None = None
        self._others = OtherPublishers()
        self._wanted = choice.joint_names
        self.parts: JointParts | None = JointParts(topic)
        """Messages that lack joints, or their positions or efforts; None once a message has all."""

    def add(self, log_time: int, message: bytes) -> None:
        """Take the next message. `log_time`: when it was logged [ns]."""
        self.messages += 1
        if self.fault is not None:
            return
        if len(message) > LARGEST_MESSAGE_BYTES:
            text = f"topic {self.topic}, message {self.messages}: is larger than any joint state ({len(message)} bytes)"
            self.fault = RecordingError(f"{self._choice.file}: {text}; choose another topic with --topic")
            return
        self._pending.append((log_time, message))
        self._pending_bytes += len(message)
        if len(self._pending) >= _MESSAGES_AT_ONCE or self._pending_bytes >= _BYTES_AT_ONCE:
            self.flush()

    def flush(self) -> None:
        """Decode what was taken and not yet decoded."""
        pending, self._pending, self._pending_bytes = self._pending, [], 0
        if not pending or self.fault is not None:
            return
        first = self.messages - len(pending) + 1
        log_time = np.array([time for time, _ in pending], dtype=np.uint64).astype(np.int64)
        try:
            messages = [
                self._decode_one(decompress_message, message, first + row) for row, (_, message) in enumerate(pending)
            ]
            self._unpacked_bytes += sum(map(len, messages))
            if self._choice.packed_bytes is not None:
                name = f"{self._choice.file}: topic {self.topic}"
                require_plausible_inflation(self._choice.packed_bytes, self._unpacked_bytes, name, HELD_BYTES)
            batches = sorted(self._decode(messages, first), key=lambda batch: batch[0][0])
            own: list[Batch] = []
            orders: list[tuple[str, ...]] = []
            for at, states in batches:
                if self._is_own(states, first + at[0]):
                    own.append((at, self._arrange(states)))
                    orders.append(states.names)
                elif self.parts is not None:
                    self.parts.add(states, log_time[at], self._wanted or ())
            own = self._others.leave_out(own, orders)
            if own:
                rows, states = _merge(own)
                self._take(states, log_time[rows], first + rows)
        except RecordingError as error:
            self.fault = error

    @property
    def samples(self) -> int:
        """Number of samples collected so far."""
        return 0 if self._rows is None else len(self._rows)

    @property
    def is_plain(self) -> bool:
        """Whether it carries sensor_msgs/JointState of ROS 2."""
        return self._decoder is decode_cdr

    @property
    def has_effort(self) -> bool:
        """Whether any sample has an effort."""
        return self._rows is not None and self._rows.has_effort

    def finish(self) -> Recording:
        """The recording that this topic holds. Raises RecordingError, which numbers its messages from 1."""
        self.flush()
        if self.fault is not None:
            raise self.fault
        if self._rows is None:
            raise self._others.error(f"{self._choice.file}: topic {self.topic}", self._choice.joint_names)
        recording = self._rows.finish()
        return replace(recording, notes=(*recording.notes, *self._others.notes(self.topic, self._wanted or ())))

    def _decode(self, messages: Sequence[bytes], first: int) -> list[Batch]:
        """Batches of equal layout; all of one size at once, where a publisher keeps to one layout."""
        whole = np.arange(len(messages))
        if self._decoder is not decode_cdr:
            return self._decode_each(messages, whole, first)
        sizes = np.array([len(message) for message in messages])
        batches: list[Batch] = []
        for size in dict.fromkeys(sizes.tolist()):
            rows = whole[sizes == size]
            alike = [messages[row] for row in rows]
            if size not in self._layouts:
                self._layouts[size] = self._decode_one(JointStateLayout, alike[0], first + rows[0])
            states = self._layouts[size].decode(alike)
            batches += [(rows, states)] if states is not None else self._decode_each(alike, rows, first)
        return batches

    def _decode_each(self, messages: Sequence[bytes], rows: Rows, first: int) -> list[Batch]:
        groups: dict[object, list[tuple[int, JointState]]] = {}
        for row, message in zip(rows.tolist(), messages, strict=True):
            state = self._decode_one(self._decoder, message, first + row)
            lengths = (len(array) for array in (state.position, state.velocity, state.effort))
            groups.setdefault((state.names, *lengths), []).append((row, state))
        return [(np.array([row for row, _ in g]), _stack([state for _, state in g])) for g in groups.values()]

    def _decode_one(self, decode: Callable[[bytes], Decoded], message: bytes, number: int) -> Decoded:
        """`decode(message)`, its complaint turned into one that names the message."""
        try:
            return decode(message)
        except (ValueError, OverflowError) as error:
            raise RecordingError(
                f"{self._choice.file}: topic {self.topic}, message {number}: not a JointState message ({reason(error)})"
            ) from error

    def _is_own(self, states: JointStates, number: int) -> bool:
        """Whether messages are of the wanted joints, by their names, and hold positions and efforts."""
        count, names = states.position.shape[1], states.names
        wanted = self._wanted
        if wanted is not None:
            is_own = set(wanted) <= set(names) if names else count == len(wanted)
            if not is_own:
                self._others.add(names or (f"{count} joints without names",), "", len(states.stamp))
                return False
        if not (count and states.effort.shape[1]):
            self._others.add(names, "effort" if count else "positions", len(states.stamp))
            return False
        _require_equal(states, f"{self._choice.file}: topic {self.topic}, message {number}")
        self._wanted = wanted or names or None
        return True

    def _arrange(self, states: JointStates) -> JointStates:
        names = states.names
        if self._wanted is None or not names or names == self._wanted:
            return states
        order = [names.index(name) for name in self._wanted]
        has_velocity = states.velocity.shape[1] > 0
        velocity = states.velocity[:, order] if has_velocity else states.velocity
        return JointStates(states.stamp, self._wanted, states.position[:, order], velocity, states.effort[:, order])

    def _take(self, states: JointStates, log_time: NDArray[np.int64], number: Rows) -> None:
        if self._rows is None:
            self.parts = None
            count, has_velocity = states.position.shape[1], states.velocity.shape[1] > 0
            self._rows = _Rows(self._choice, self.topic, count, has_velocity=has_velocity)
        self._rows.append(states, log_time, number)


class _Rows:
    """The rows of one topic: relative time, positions, efforts and, where they are sent, velocities."""

    def __init__(self, choice: Choice, topic: str, joint_count: int, *, has_velocity: bool) -> None:
        self._name, self._topic = choice.file, topic
        self._joint_count, self._has_velocity = joint_count, has_velocity
        columns = table_columns(joint_count, EffortKind.TORQUE, ("qd",) if has_velocity else ())
        self._intake = RowIntake(choice, columns, EffortKind.TORQUE)
        self._origin: int | None = None
        self._by_log_time = False
        self._unset = 0
        self.has_effort = False

    def __len__(self) -> int:
        return len(self._intake)

    def append(self, states: JointStates, log_time: NDArray[np.int64], number: Rows) -> None:
        """Add messages; the clock is the header stamp, or the log's where the first batch has no stamps at all."""
        stamp = states.stamp
        unset = (stamp == 0) & (stamp.max() > LONGEST_FROM_ZERO_NS)
        if unset.any() and not self._by_log_time:  # the log's clock is as far ahead as for the other messages
            ahead = np.median((log_time - stamp)[~unset]).astype(np.int64)
            stamp = np.where(unset, log_time - ahead, stamp)
            self._unset += int(unset.sum())
        if self._origin is None:
            self._by_log_time = not stamp.any()
            self._origin = int(log_time[0] if self._by_log_time else stamp[0])
        elif self._by_log_time and stamp.any():
            raise RecordingError(
                f"{self._name}: topic {self._topic}, message {number[np.argmax(stamp != 0)]}: "
                "has a time stamp where the messages before it have none"
            )
        clock = log_time if self._by_log_time else stamp
        time = (clock - self._origin).astype(np.float64) * 1e-9
        parts = [time[:, None], states.position, states.effort]
        self.has_effort = self.has_effort or bool(np.isfinite(parts[2]).any())
        if self._has_velocity:
            is_sent = states.velocity.shape[1] > 0
            parts.append(states.velocity if is_sent else np.full_like(parts[2], np.nan))
        block = np.hstack(parts)
        self._intake.add(block, lambda row: f"topic {self._topic}, message {number[row]}")

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


def _stack(states: Sequence[JointState]) -> JointStates:
    stamp = np.array([state.stamp for state in states], dtype=np.int64)
    fields = ("position", "velocity", "effort")
    return JointStates(stamp, states[0].names, *(np.array([getattr(s, field) for s in states]) for field in fields))


def _merge(batches: Sequence[Batch]) -> Batch:
    """Batches of one publisher in the order of its messages; velocities are NaN where some messages lack them."""
    rows = np.concatenate([rows for rows, _ in batches])
    order = np.argsort(rows)
    states = [states for _, states in batches]
    has_velocity = any(each.velocity.shape[1] for each in states)
    velocity = [
        each.velocity if each.velocity.shape[1] or not has_velocity else np.full_like(each.position, np.nan)
        for each in states
    ]
    parts = ([each.position for each in states], velocity, [each.effort for each in states])
    stamp = np.concatenate([each.stamp for each in states])[order]
    return rows[order], JointStates(stamp, states[0].names, *(np.concatenate(part)[order] for part in parts))


def _require_equal(states: JointStates, place: str) -> None:
    """Every joint has a name, where any has, a position and an effort, and a velocity where any has."""
    joints = states.position.shape[1]
    if states.names and len(states.names) != joints:
        raise RecordingError(f"{place}: {len(states.names)} joint names and {joints} positions")
    for field, count in (("efforts", states.effort.shape[1]), ("velocities", states.velocity.shape[1] or joints)):
        if count != joints:
            raise RecordingError(f"{place}: {joints} positions and {count} {field}")
    if len(set(states.names)) != len(states.names):
        raise RecordingError(f"{place}: a joint is named twice ({listed(states.names)})")


_PREFERRED_TOPICS = ("/joint_states", "joint_states")

MessageHandler = Callable[[int, bytes], None]  # takes the log time [ns] and the bytes of a message


class JointStateLog:
    """Joint states of one or several container files that were recorded together."""

    def __init__(self, choice: Choice) -> None:
        self._choice = choice
        self._topics: dict[str, JointStateTopic] = {}
        self._others: list[str] = []

    def handler(self, topic: str, type_name: str, encoding: str, schema: bytes = b"") -> MessageHandler | None:
        """The taker of a topic's messages, None where they are not joint states, or not the wanted ones."""
        decoder = find_decoder(type_name, encoding, schema)
        if decoder is None:
            self._others.append(f"{topic} ({type_name}, {encoding})" if type_name else topic)
            return None
        if topic not in self._topics:
            self._topics[topic] = JointStateTopic(topic, decoder, self._choice)
        is_wanted = self._choice.reading.topic in (None, topic)
        return self._topics[topic].add if is_wanted else None

    @property
    def samples(self) -> int:
        """Number of samples that the topic with most of them holds so far."""
        for topic in self._topics.values():
            topic.flush()
        return max((topic.samples for topic in self._topics.values()), default=0)

    def finish(self) -> Recording:
        """The recording that the log holds; raises `RecordingError` where there is none, or more than one."""
        wanted = self._choice.reading.topic
        if wanted is not None and wanted not in self._topics:
            known = listed(sorted(self._topics)) or "none"
            raise RecordingError(f"{self._choice.file}: no topic {wanted} carries joint states; those that do: {known}")
        parts = [topic.parts for topic in self._topics.values() if topic.fault is None and topic.parts is not None]
        if self._choice.joint_names and not self.samples:
            merged = merge_parts(parts, self._choice.joint_names, self._choice)
            if merged is not None:
                return merged
        return choose_topic(self._topics, self._others, self._choice.file).finish()


def choose_topic(topics: Mapping[str, JointStateTopic], other_topics: Sequence[str], file: str) -> JointStateTopic:
    """The one topic with efforts of the wanted joints, or the one that ROS would take. Raises RecordingError."""
    filled = {name: topic for name, topic in topics.items() if topic.messages}
    if not filled:
        found = f"; it holds the topics {listed(sorted(set(other_topics)))}" if other_topics else ""
        raise RecordingError(f"{file}: no sensor_msgs/msg/JointState message was recorded{found}")
    for topic in filled.values():
        topic.flush()
    usable = {name: topic for name, topic in filled.items() if topic.has_effort}
    best = usable or {name: topic for name, topic in filled.items() if topic.samples} or filled
    named = [name for name in _PREFERRED_TOPICS if name in best][:1]
    named = named or [name for name in best if name.endswith("/joint_states")]  # beside commands
    if len(named) == 1:
        return best[named[0]]
    plain = {name: topic for name, topic in best.items() if topic.is_plain}  # beside ros2_control's dynamic states
    best = plain if len(plain) == 1 else best
    if len(best) > 1:
        raise RecordingError(
            f"{file}: several topics carry joint states ({listed(sorted(best))}); choose one with --topic"
        )
    return next(iter(best.values()))
