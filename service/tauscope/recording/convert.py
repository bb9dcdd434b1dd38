"""Write a recording in another format, whole or not at all."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap_ros2.writer import Writer

from tauscope.errors import RecordingError, explain_os_errors
from tauscope.files import open_atomically
from tauscope.recording.column_files import write_parquet
from tauscope.recording.csv_format import write_csv
from tauscope.recording.intake import Choice
from tauscope.recording.joint_state import JOINT_STATE_DEFINITION
from tauscope.recording.joint_state_decoders import JOINT_STATE_TYPES
from tauscope.recording.mcap_format import MCAP_MAGIC, recover_mcap
from tauscope.recording.reading import first_bytes, read_recording
from tauscope.recording.recording import Array, EffortKind, Recording
from tauscope.recording.units import SI, Reading
from tauscope.robot.robot import Robot

_ROWS_WRITTEN_AT_ONCE = 8192
_LATEST_STAMP_S = 2.0**31


def write_mcap(recording: Recording, file: BinaryIO, joint_names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Write ``/joint_states``. Raises RecordingError for currents, and for times that are no nanoseconds."""
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
    if time[-1] >= _LATEST_STAMP_S:
        raise RecordingError(f"{name}: time {float(time[-1])!r} s is beyond a ROS time stamp; let t start near 0 s")
    stamps = np.rint(time * 1e9).astype(np.int64)
    if not (np.diff(stamps, prepend=previous) > 0).all():
        raise RecordingError(f"{name}: samples less than 1 ns apart cannot be told apart by ROS time stamps; use .csv")
    return stamps.tolist()


FORMATS = (".csv", ".parquet", ".mcap")  # formats that can be written, by suffix


@dataclass(frozen=True)
class Conversion:
    """What `convert_recording` did."""

    source: str
    target: str
    samples: int
    dropped_columns: tuple[str, ...]
    damage: str | None


def convert_recording(
    source: str | Path,
    target: str | Path,
    *,
    recover: bool = False,
    overwrite: bool = False,
    joint_names: Sequence[str] | None = None,
    robot: Robot | None = None,
    reading: Reading = SI,
) -> Conversion:
    """Write a recording, in SI, as the target's suffix says; MCAP holds whole nanoseconds, q, τ and q̇ only.

    Raises RecordingError where the source cannot be read, or the target cannot hold it or exists.
    """
    source_path, target_path = Path(source), Path(target)
    _require_other(source_path, target_path)
    _require_writable(target_path, overwrite=overwrite)
    if robot is not None:
        joint_names = [joint.name for joint in robot.joints]
    recording, damage = _read(source_path, str(source), joint_names, reading.for_robot(robot), recover=recover)
    dropped = write_recording(recording, target_path, joint_names=joint_names, overwrite=overwrite)
    return Conversion(str(source), str(target), len(recording), (*dropped, *recording.ignored_columns), damage)


def write_recording(
    recording: Recording, path: str | Path, *, joint_names: Sequence[str] | None = None, overwrite: bool = False
) -> tuple[str, ...]:
    """Write a recording, whole or not at all. Raises RecordingError where the target exists or is no format."""
    path = Path(path)
    _require_writable(path, overwrite=overwrite)
    with explain_os_errors(RecordingError, f"{path}: cannot be written"), open_atomically(path) as file:
        if path.suffix.lower() == ".mcap":
            return write_mcap(recording, file, joint_names)
        (write_parquet if path.suffix.lower() == ".parquet" else write_csv)(recording, file)
        return ()


def _read(
    path: Path, name: str, joint_names: Sequence[str] | None, reading: Reading, *, recover: bool
) -> tuple[Recording, str | None]:
    if recover and path.is_file() and first_bytes(path, name).startswith(MCAP_MAGIC):
        names = tuple(joint_names) if joint_names is not None else None
        return recover_mcap(path, Choice(name, len(names) if names else None, names, reading=reading))
    return read_recording(path, joint_names=joint_names, reading=reading), None


def _require_other(source: Path, target: Path) -> None:
    if target.exists() and source.exists() and target.samefile(source):
        raise RecordingError(f"{target}: is the source itself; a recording given as input is never written to")
    if source.is_dir() and target.absolute().parent.resolve() == source.resolve():
        raise RecordingError(f"{target}: lies within the source folder; choose another folder")


def _require_writable(path: Path, *, overwrite: bool) -> None:
    if path.suffix.lower() not in FORMATS:
        raise RecordingError(f"{path}: the suffix names no format that can be written; use {', '.join(FORMATS)}")
    if path.is_dir() or (path.exists() and not overwrite):
        raise RecordingError(f"{path}: exists already; choose another name or ask for it to be overwritten")
