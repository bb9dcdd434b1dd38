"""Write a recording in another format, whole or not at all."""

import os
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from tauscope.errors import RecordingError
from tauscope.recording.csv_format import write_csv
from tauscope.recording.joint_state_topic import Choice
from tauscope.recording.mcap_format import MCAP_MAGIC, recover_mcap
from tauscope.recording.mcap_writing import write_mcap
from tauscope.recording.parquet_format import write_parquet
from tauscope.recording.reading import first_bytes, read_recording
from tauscope.recording.recording import Recording
from tauscope.recording.units import SI, Reading
from tauscope.robot.robot import Robot

FORMATS = (".csv", ".parquet", ".mcap")
"""Formats that can be written, by suffix."""


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
    """Write a recording, in SI, in the format that the target's suffix names.

    MCAP holds time from the first sample on in whole nanoseconds, positions, torques and velocities; CSV and Parquet
    hold every column exactly. Raises RecordingError where the source cannot be read, or the target cannot hold it or
    exists.
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
    """Write a recording; the file appears under its name only when it is complete.

    Raises RecordingError where the file exists or cannot be written, or its suffix names no format.
    """
    path = Path(path)
    _require_writable(path, overwrite=overwrite)
    dropped: tuple[str, ...] = ()

    def write(file: BinaryIO) -> None:
        nonlocal dropped
        suffix = path.suffix.lower()
        if suffix == ".mcap":
            dropped = write_mcap(recording, file, joint_names)
        elif suffix == ".parquet":
            write_parquet(recording, file)
        else:
            write_csv(recording, file)

    _write_atomically(path, write)
    return dropped


def _read(
    path: Path, name: str, joint_names: Sequence[str] | None, reading: Reading, *, recover: bool
) -> tuple[Recording, str | None]:
    """The recording, and the damage that was passed over where that was asked for."""
    if recover and path.is_file() and first_bytes(path, name).startswith(MCAP_MAGIC):
        names = tuple(joint_names) if joint_names is not None else None
        salvage = recover_mcap(path, Choice(name, len(names) if names else None, names, reading=reading))
        return salvage.recording, salvage.damage
    return read_recording(path, joint_names=joint_names, reading=reading), None


def _require_other(source: Path, target: Path) -> None:
    """Refuse to write to what is read."""
    if target.exists() and source.exists() and target.samefile(source):
        raise RecordingError(f"{target}: is the source itself; a recording given as input is never written to")
    if source.is_dir() and target.absolute().parent.resolve() == source.resolve():
        raise RecordingError(f"{target}: lies within the source folder; choose another folder")


def _require_writable(path: Path, *, overwrite: bool) -> None:
    """Refuse unknown formats, and files that are there already."""
    if path.suffix.lower() not in FORMATS:
        raise RecordingError(f"{path}: the suffix names no format that can be written; use {', '.join(FORMATS)}")
    if path.is_dir() or (path.exists() and not overwrite):
        raise RecordingError(f"{path}: exists already; choose another name or ask for it to be overwritten")


def _write_atomically(path: Path, write: Callable[[BinaryIO], None]) -> None:
    """Write beside the target and move into place; nothing is left where writing fails."""
    partial = path.with_name(f".{path.name}.{secrets.token_hex(6)}.partial")
    try:
        try:
            with partial.open("xb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror or error})") from error
