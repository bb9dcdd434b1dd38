"""Recordings written as MCAP, by the library of the MCAP project, for Foxglove, PlotJuggler and ROS 2."""

from collections.abc import Sequence
from typing import BinaryIO

import numpy as np
from mcap_ros2.writer import Writer

from tauscope.errors import RecordingError
from tauscope.recording.joint_state_decoders import JOINT_STATE_TYPES
from tauscope.recording.joint_state_encoding import JOINT_STATE_DEFINITION
from tauscope.recording.recording import Array, EffortKind, Recording

_ROWS_WRITTEN_AT_ONCE = 8192
_LATEST_STAMP_S = 2.0**31


def write_mcap(recording: Recording, file: BinaryIO, joint_names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Write a recording as ``/joint_states`` of type sensor_msgs/msg/JointState.

    Raises RecordingError where efforts are currents, or times cannot be kept as nanoseconds.
    """
    if recording.effort_kind is not EffortKind.TORQUE:
        raise RecordingError(f"{recording.name}: JointState holds torques and this recording currents (i1…); use .csv")
    n = recording.joint_count
    names = list(joint_names) if joint_names is not None else [f"joint{joint}" for joint in range(1, n + 1)]
    if len(names) != n:
        raise RecordingError(f"{recording.name}: {len(names)} joint names for {n} joints")
    # A JointState has the velocity of every joint or of none.
    has_velocity = all(f"qd{joint}" in recording.table.names for joint in range(1, n + 1))
    kept = ("t", "q", "tau", "qd") if has_velocity else ("t", "q", "tau")
    writer = Writer(file)
    schema = writer.register_msgdef(JOINT_STATE_TYPES[0], JOINT_STATE_DEFINITION)
    offset = min(float(recording.samples(0, 1).time[0]), 0.0)
    previous = -1
    for start in range(0, len(recording), _ROWS_WRITTEN_AT_ONCE):
        samples = recording.samples(start, start + _ROWS_WRITTEN_AT_ONCE)
        stamps = _stamps(samples.time - offset, previous, recording.name)
        velocity = samples.velocity.tolist() if has_velocity and samples.velocity is not None else [[]] * len(stamps)
        rows = zip(stamps, samples.position.tolist(), velocity, samples.effort.tolist(), strict=True)
        for stamp, position, qd, effort in rows:
            time = {"sec": stamp // 1_000_000_000, "nanosec": stamp % 1_000_000_000}
            header = {"stamp": time, "frame_id": ""}
            message = {"header": header, "name": names, "position": position, "velocity": qd, "effort": effort}
            writer.write_message("/joint_states", schema, message, log_time=stamp)
        previous = stamps[-1]
    writer.finish()
    return tuple(name for name in recording.table.names if name.rstrip("0123456789") not in kept)


def _stamps(time: Array, previous: int, name: str) -> list[int]:
    """Times as whole nanoseconds, still strictly increasing."""
    if time[-1] >= _LATEST_STAMP_S:
        raise RecordingError(f"{name}: time {float(time[-1])!r} s is beyond a ROS time stamp; let t start near 0 s")
    stamps = np.rint(time * 1e9).astype(np.int64)
    if not (np.diff(stamps, prepend=previous) > 0).all():
        raise RecordingError(f"{name}: samples less than 1 ns apart cannot be told apart by ROS time stamps; use .csv")
    return stamps.tolist()
