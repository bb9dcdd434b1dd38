"""The journal of a run: an MCAP file that is written while the arm moves, and readable whenever the writer dies.

Topics: ``/joint_states`` is what was measured, effort as torque, for Foxglove, PlotJuggler and `read_recording`;
``/tauscope/reference`` what was asked for, as joint states too; ``/tauscope/cycle`` the rest of each cycle and
``/tauscope/events`` what happened, both as JSON. Chunks hold about a tenth of a second and reach the system when full.
"""

import fcntl
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mcap.well_known import SchemaEncoding
from mcap.writer import Writer
from numpy.typing import NDArray
from pydantic_core import to_json

from tauscope.recording.joint_state import JOINT_STATE_DEFINITION, JointStateEncoder
from tauscope.recording.joint_state_decoders import JOINT_STATE_TYPES
from tauscope.recording.journal_rows import JournalHeader, Phase, journal_row_type

JOINT_STATE_TOPIC = "/joint_states"
REFERENCE_TOPIC = "/tauscope/reference"
CYCLE_TOPIC = "/tauscope/cycle"
EVENT_TOPIC = "/tauscope/events"
CYCLE_TYPE = "tauscope.Cycle"
EVENT_TYPE = "tauscope.Event"

_CHUNK_S = 0.1
_BYTES_A_MESSAGE = 31
_MESSAGES_A_ROW = 3
_CYCLE_SCHEMA = {
    "title": CYCLE_TYPE,
    "type": "object",
    "properties": {
        "phase": {"type": "string", "enum": [phase.name.lower() for phase in Phase]},
        "period": {"type": ["number", "null"]},
        "lateness_ns": {"type": "integer"},
        "temperature": {"type": "array", "items": {"type": ["number", "null"]}},
        "voltage": {"type": "array", "items": {"type": ["number", "null"]}},
    },
}
_EVENT_SCHEMA = {"title": EVENT_TYPE, "type": "object", "properties": {"event": {"type": "string"}}}
_PHASES = tuple(phase.name.lower() for phase in Phase)


class JournalWriter:
    """Writes rows and events of one run, in the order in which they come."""

    def __init__(self, path: Path, header: JournalHeader, *, synchronise: bool = False) -> None:
        """Create the file; it must not exist. Raises OSError where the file exists or cannot be created."""
        self.header = header
        self.rows = 0
        self._synchronise = synchronise
        self._row_type = journal_row_type(header.joint_count)
        self._factor = np.array(header.torque_per_effort)
        self._file = path.open("xb")
        # Held until this process closes the file or dies: whoever reads can tell whether more is to come.
        fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        names = header.joint_names
        self._measured = JointStateEncoder(names, has_velocity=header.has_velocity)
        self._asked = JointStateEncoder(names)
        sample = len(self._measured.encode(0, np.zeros(len(names)), None, None))
        row_bytes = _MESSAGES_A_ROW * (sample + _BYTES_A_MESSAGE)
        self._writer = Writer(self._file, chunk_size=max(int(_CHUNK_S * header.rate_hz * row_bytes), row_bytes))
        self._start()

    def write_rows(self, rows: NDArray[np.void]) -> None:
        """Write cycles, `rows`: (k,) of `journal_row_type`. Raises OSError where the disk does not take them."""
        before = self._file.tell()
        for row in rows:
            stamp = int(row["time_ns"]) + self.header.epoch_offset_ns
            velocity = row["velocity"] if self.header.has_velocity else None
            measured = self._measured.encode(stamp, row["position"], velocity, row["effort"] * self._factor)
            asked = self._asked.encode(stamp, row["reference"], row["reference_velocity"], row["command"])
            cycle = {
                "phase": _PHASES[row["phase"]],
                "period": float(row["period"]),
                "lateness_ns": int(row["lateness_ns"]),
                "temperature": row["temperature"].tolist(),
                "voltage": row["voltage"].tolist(),
            }
            self._add(JOINT_STATE_TOPIC, stamp, measured)
            self._add(REFERENCE_TOPIC, stamp, asked)
            self._add(CYCLE_TOPIC, stamp, to_json(cycle, inf_nan_mode="null"))
        self.rows += len(rows)
        if self._file.tell() != before:
            self._flush()

    def write_event(self, time_ns: int, event: Mapping[str, Any]) -> None:
        """Write what happened. `time_ns`: when, by the clock of the rows [ns]."""
        self._add(EVENT_TOPIC, time_ns + self.header.epoch_offset_ns, to_json(dict(event), inf_nan_mode="null"))

    def close(self) -> None:
        """Write the index and close the file; closing again does nothing."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
            self._flush()
        finally:
            self._file.close()

    def _start(self) -> None:
        """Write the file's head: schemas, channels and the header as first event."""
        self._writer.start(profile="ros2", library="tauscope")
        joint_state = self._writer.register_schema(
            JOINT_STATE_TYPES[0], SchemaEncoding.ROS2, JOINT_STATE_DEFINITION.encode()
        )
        cycle = self._writer.register_schema(CYCLE_TYPE, SchemaEncoding.JSONSchema, to_json(_CYCLE_SCHEMA))
        event = self._writer.register_schema(EVENT_TYPE, SchemaEncoding.JSONSchema, to_json(_EVENT_SCHEMA))
        self._channels = {
            JOINT_STATE_TOPIC: self._writer.register_channel(JOINT_STATE_TOPIC, "cdr", joint_state),
            REFERENCE_TOPIC: self._writer.register_channel(REFERENCE_TOPIC, "cdr", joint_state),
            CYCLE_TOPIC: self._writer.register_channel(CYCLE_TOPIC, "json", cycle),
            EVENT_TOPIC: self._writer.register_channel(EVENT_TOPIC, "json", event),
        }
        self.write_event(0, {"event": "journal", "header": self.header.to_dict()})
        self._flush()

    def _add(self, topic: str, stamp: int, data: bytes) -> None:
        self._writer.add_message(self._channels[topic], log_time=stamp, data=data, publish_time=stamp)

    def _flush(self) -> None:
        """Hand what is complete to the system, which keeps it when this process dies."""
        self._file.flush()
        if self._synchronise:
            os.fsync(self._file.fileno())
