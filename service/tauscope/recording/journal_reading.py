"""A run's journal read back, also where its writer died in the middle of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import from_json

from tauscope.errors import RecordingError, explain_os_errors
from tauscope.recording.joint_state import JointStateLayout, JointStates
from tauscope.recording.joint_state_topic import MessageHandler
from tauscope.recording.journal import CYCLE_TOPIC, EVENT_TOPIC, JOINT_STATE_TOPIC, REFERENCE_TOPIC
from tauscope.recording.journal_rows import JournalHeader, Phase, journal_row_type
from tauscope.recording.mcap_format import scan_mcap
from tauscope.recording.recording import Array, EffortKind, Recording
from tauscope.robot.messages import reason

LONGEST_HOLD = 1.5  # cycles between two samples of which none was missed between them


@dataclass(frozen=True, eq=False)
class Journal:
    """What a journal holds."""

    header: JournalHeader
    rows: NDArray[np.void]  # (N,) of `journal_row_type`, the cycles, oldest first
    events: tuple[dict[str, Any], ...]
    damage: str | None  # why reading stopped before the file's end, None where the file is whole

    @property
    def motion(self) -> NDArray[np.void]:
        """The rows of the motion itself, without the ramp."""
        return self.rows[self.rows["phase"] == Phase.MOTION]


def read_journal(path: Path) -> Journal:
    """Read a journal up to its end or its first damage. Raises RecordingError where its header did not come through."""
    collector = _Collector()
    with explain_os_errors(RecordingError, f"{path}: the journal cannot be read"):
        damage = scan_mcap(path, collector)
    try:
        header = collector.header()
        return Journal(header, collector.rows(header), tuple(collector.events[1:]), damage)
    except (ValueError, TypeError, KeyError) as error:
        extent = f"{damage}; " if damage else ""
        raise RecordingError(f"{path}: {extent}no run's journal can be read from it ({reason(error)})") from error


def journal_recording(journal: Journal, name: str) -> Recording:
    """A journal's motion from its first sample, without ramp: reported columns, qref, taucmd and period where known.

    Where the host commanded effort, tau (i) is the mean of what acted before and after the sample. Raises
    RecordingError where the motion was never reached.
    """
    rows, header = journal.motion, journal.header
    if not len(rows):
        ramp = f" of {len(journal.rows)} cycles of the ramp" if len(journal.rows) else ""
        raise RecordingError(f"{name}: the run ended before its motion began{ramp}: there is nothing to keep")
    is_torque, is_held = header.effort_unit == "Nm", header.mode == "torque"
    return Recording.from_arrays(
        name,
        (rows["time_ns"] - rows["time_ns"][0]) * 1e-9,
        rows["position"],
        _sample_effort(rows, 1e9 / header.rate_hz) if is_held else rows["effort"],
        effort_kind=EffortKind.TORQUE if is_torque else EffortKind.CURRENT,
        effort_command=_find_reported(rows["command"]),
        period=_find_reported(rows["period"]),
        **{name: _find_reported(rows[name]) for name in ("velocity", "reference", "temperature", "voltage")},
    )


class _Collector:
    """Keeps the messages of a journal, topic by topic."""

    def __init__(self) -> None:
        self.events: list[dict[str, Any]] = []
        self._messages: dict[str, list[bytes]] = {JOINT_STATE_TOPIC: [], REFERENCE_TOPIC: [], CYCLE_TOPIC: []}

    def handler(self, topic: str, type_name: str, encoding: str, schema: bytes = b"") -> MessageHandler | None:
        """Takes the messages of a journal's own topics."""
        del type_name, encoding, schema
        if topic == EVENT_TOPIC:
            return lambda _, data: self.events.append(from_json(data))
        if topic in self._messages:
            messages = self._messages[topic]
            return lambda _, data: messages.append(data)
        return None

    def header(self) -> JournalHeader:
        if not self.events:
            raise RecordingError("the header is missing")
        return JournalHeader.from_dict(self.events[0].get("header"))

    def rows(self, header: JournalHeader) -> NDArray[np.void]:
        """The cycles of which every message is there: damage may cut between them."""
        count = min(len(messages) for messages in self._messages.values())
        rows = np.empty(count, dtype=journal_row_type(header.joint_count))
        if not count:
            return rows
        measured = _decode(self._messages[JOINT_STATE_TOPIC][:count])
        asked = _decode(self._messages[REFERENCE_TOPIC][:count])
        if not np.array_equal(measured.stamp, asked.stamp):
            raise RecordingError("its topics do not belong to the same cycles")
        rows["time_ns"] = measured.stamp - header.epoch_offset_ns
        rows["position"], rows["effort"] = measured.position, measured.effort / np.array(header.torque_per_effort)
        rows["velocity"] = measured.velocity if header.has_velocity else np.nan
        rows["reference"], rows["reference_velocity"], rows["command"] = asked.position, asked.velocity, asked.effort
        cycles = [from_json(message) for message in self._messages[CYCLE_TOPIC][:count]]
        rows["lateness_ns"] = [cycle["lateness_ns"] for cycle in cycles]
        rows["phase"] = [Phase[cycle["phase"].upper()] for cycle in cycles]
        rows["period"] = np.array([cycle["period"] for cycle in cycles], dtype=np.float64)
        rows["temperature"] = np.array([cycle["temperature"] for cycle in cycles], dtype=np.float64)
        unknown = [None] * header.joint_count  # journals of before there was a voltage
        rows["voltage"] = np.array([cycle.get("voltage", unknown) for cycle in cycles], dtype=np.float64)
        return rows


def _decode(messages: list[bytes]) -> JointStates:
    states = JointStateLayout(messages[0]).decode(messages)
    if states is None:
        raise RecordingError("its joint states change their layout")
    return states


def _sample_effort(rows: NDArray[np.void], period_ns: float) -> Array:
    """Effort at the instants of the samples, where drives hold it from one command to the next, (N, n).

    A drive reports what it has held until the sample: by itself that is half a cycle late. The next sample tells what
    it held from there on; where that one was missed, nothing does.
    """
    before = rows["effort"]
    after = np.full_like(before, np.nan)
    is_next = np.diff(rows["time_ns"]) < LONGEST_HOLD * period_ns
    after[:-1][is_next] = before[1:][is_next]
    return 0.5 * (before + after)


def _find_reported(column: Array) -> Array | None:
    """A column, None where not one sample of it was reported."""
    return None if np.isnan(column).all() else column
