"""Read a recording, whatever its format, or tell which of its columns is read as which."""

import errno
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from pydantic import Field

from tauscope.errors import RecordingError
from tauscope.recording import array_files, column_files
from tauscope.recording.columns import is_column, require_joint_count
from tauscope.recording.csv_format import read_csv, read_csv_header
from tauscope.recording.inflation import HELD_BYTES, decompress_file, is_packed
from tauscope.recording.intake import Choice
from tauscope.recording.joint_state_topic import JointStateLog
from tauscope.recording.layout.guess import guess_parts
from tauscope.recording.layout.rename import rename_columns
from tauscope.recording.mapping import find_layout, suggest_layout
from tauscope.recording.mcap_format import MCAP_MAGIC, add_mcap
from tauscope.recording.recording import Recording
from tauscope.recording.ros_bags import ROS1_MAGIC, SQLITE_MAGIC, add_database, add_ros1_bag, add_rosbag2
from tauscope.recording.units import SI, Reading
from tauscope.remote_files import copy_locally, find_path, is_folder, knows_ranges, name_failures, open_ranges
from tauscope.robot.messages import printable
from tauscope.robot.recording_layout import UNITS, RecordingLayout
from tauscope.robot.robot import Robot
from tauscope.strict_model import entry


@dataclass(frozen=True)
class _Format:
    """A table, or a log, whose joint states are added to a `JointStateLog`; told by its first bytes."""

    magic: bytes
    read_table: Callable[[Path, Choice], Recording] | None = None
    read_header: Callable[[Path, str], list[str]] | None = None
    add_log: Callable[[Path, str, JointStateLog], None] | None = None
    reads_ranges: bool = False  # of a remote file; others are copied first


_FORMATS = (
    _Format(column_files.PARQUET_MAGIC, column_files.read_parquet, column_files.read_parquet_header, reads_ranges=True),
    _Format(MCAP_MAGIC, add_log=add_mcap, reads_ranges=True),
    _Format(SQLITE_MAGIC, add_log=add_database),
    _Format(ROS1_MAGIC, add_log=add_ros1_bag),
    *(_Format(magic, array_files.read_arrays, array_files.read_arrays_header) for magic in array_files.MAGICS),
)
_JSON = _Format(b"", array_files.read_arrays, array_files.read_arrays_header)
_CSV = _Format(b"", read_csv, read_csv_header)
_FOLDER = _Format(b"", add_log=add_rosbag2, reads_ranges=True)

_LONGEST_PATH = 4096
_MAGIC_BYTES = 16
_FOREIGN = (
    (b"\x89HDF", "is an HDF5 file; export it as CSV or Parquet"),
    (b"MATLAB 7.3", "is a MATLAB file of version 7.3; save it by save(..., '-v7')"),
    (b"header:\n", "is text of `ros2 topic echo`; record a bag, or echo with --csv"),
    (b"#ROSBAG V1", "is a bag of ROS 0.x; run `rosbag fix` on it first"),
    (b"\xff\xfe", "is UTF-16 text; save it as UTF-8"),
    (b"\xfe\xff", "is UTF-16 text; save it as UTF-8"),
)


def read_recording(
    path: str | Path, joint_count: int | None = None, joint_names: Sequence[str] | None = None, reading: Reading = SI
) -> Recording:
    """Read CSV, JSON, Parquet, NumPy, MATLAB, MCAP, a ROS 1 bag, or a rosbag2 folder or database, told by content.

    Raises RecordingError, which names the place; RecordingMismatchError for other joints than `joint_count` asks for.
    """
    path = find_path(path)
    name = printable(str(path), _LONGEST_PATH)
    names = tuple(joint_names) if joint_names is not None else None
    reading = replace(reading, joint_names=names)
    if joint_count is None and names is not None:
        joint_count = len(names)
    try:
        with name_failures(path):
            packed_bytes = sum(file.stat().st_size for file in (path.iterdir() if is_folder(path) else [path]))
            choice = Choice(name, joint_count, names, reading=reading, packed_bytes=packed_bytes)
            with _unpack(path, name) as plain:
                recording = _read(plain, choice)
    except OSError as error:
        raise RecordingError(f"{name}: {_reason(error)}") from error
    require_joint_count(recording.joint_count, joint_count, name)
    return recording


def read_header(path: Path) -> list[str]:
    """Names of a table's columns, or numbers from 1. Raises RecordingError where it is a log, which names joints."""
    path = find_path(path)
    name = printable(str(path), _LONGEST_PATH)
    try:
        if not isinstance(path, Path):
            with name_failures(path), copy_locally(path) as copy:
                return read_header(copy)
        with _unpack(path, name) as plain:
            found = _find_format(plain, name)
            if found.read_header is None:
                raise RecordingError(f"{name}: a log names its joints itself; choose a topic with --topic")
            return found.read_header(plain, name)
    except OSError as error:
        raise RecordingError(f"{name}: {_reason(error)}") from error


def first_bytes(path: Path, name: str) -> bytes:
    """The first bytes of a file, by which formats are told apart. Raises RecordingError where it is not regular."""
    if isinstance(path, Path) and not path.is_file():
        if not path.exists():
            raise FileNotFoundError(errno.ENOENT, "no such file")
        raise RecordingError(f"{name}: not a regular file; save the data to a file first")
    with open_ranges(path) as file:
        return file.read(_MAGIC_BYTES)


@contextmanager
def _unpack(path: Path, name: str) -> Iterator[Path]:
    """The path itself, or what is in a packed file, unpacked: ``log.csv.gz``."""
    if is_folder(path) or not is_packed(first_bytes(path, name)):
        yield path
        return
    with copy_locally(path) as packed, TemporaryDirectory(prefix="tauscope-") as folder:
        yield decompress_file(packed, Path(folder) / path.stem, name, HELD_BYTES)


def _read(path: Path, choice: Choice) -> Recording:
    found = _find_format(path, choice.file)
    if not (isinstance(path, Path) or found is _FOLDER or (found.reads_ranges and knows_ranges(path))):
        with copy_locally(path) as copy:
            return _read(copy, choice)
    if found.read_table is not None:
        return found.read_table(path, choice)
    log = JointStateLog(choice)
    assert found.add_log is not None  # noqa: S101 - it is no table
    found.add_log(path, choice.file, log)
    return log.finish()


def _find_format(path: Path, name: str) -> _Format:
    """The format of a file or folder, CSV where nothing tells another. Raises RecordingError where none is read."""
    if is_folder(path):
        return _FOLDER
    magic = first_bytes(path, name)
    for each in _FORMATS:
        if magic.startswith(each.magic):
            return each
    if is_packed(magic):
        raise RecordingError(f"{name}: is compressed twice; unpack it first")
    for start, words in _FOREIGN:
        if magic.startswith(start):
            raise RecordingError(f"{name}: {words}")
    if path.suffix.lower() in (".mcap", ".parquet", ".db3", ".bag"):
        found = "is empty" if not magic else f"does not begin as a {path.suffix.lower()} file does"
        raise RecordingError(f"{name}: the file {found}; it is damaged or of another format")
    return _JSON if array_files.JSON_START.match(magic) else _CSV


def _reason(error: OSError) -> str:
    words = {errno.ENOENT: "no such file", errno.EACCES: "no permission to read it"}
    return words.get(error.errno or 0, f"cannot be read ({error.strerror or error})")


@entry
class ColumnMapping:
    """A file's columns as they are understood."""

    header: tuple[str, ...] = Field(description="names of the file's columns; numbers from 1 where it has no names")
    columns: Mapping[str, str] = Field(description="the file's column for t, q1, tau1, …; only those that were found")
    units: Mapping[str, str] = Field(description="of t, q, qd and tau")
    is_guessed: bool = Field(description="whether only the words of the column names suggest it")


def find_mapping(path: Path, robot: Robot | None = None, reading: Reading = SI) -> ColumnMapping:
    """The mapping by which a table is read, or that its column names suggest. Raises RecordingError for a log."""
    header = tuple(read_header(path))
    reading = reading.for_robot(robot)
    try:
        used, layout = find_layout(header, reading, path.name)
    except RecordingError:
        return _suggest(header, reading)
    places = zip(layout.names, layout.source, strict=True)
    columns = {name: header[place] for name, place in places if not (name == "t" and layout.counts_rows)}
    return ColumnMapping(header, columns, _complete_units(used.units, columns), is_guessed=False)


def _suggest(header: Sequence[str], reading: Reading) -> ColumnMapping:
    if reading.columns is None:
        guess = suggest_layout(header, reading, "") or RecordingLayout(columns=guess_parts(header, reading))
        reading = replace(reading, columns=guess.columns, units={**guess.units, **reading.units})
    renamed: Sequence[str] = ()
    with suppress(RecordingError):
        renamed = rename_columns(header, reading, "")
    columns = {target: name for target, name in zip(renamed, header, strict=False) if is_column(target)}
    return ColumnMapping(tuple(header), columns, _complete_units(reading.units, columns), is_guessed=True)


def _complete_units(stated: Mapping[str, str], columns: Mapping[str, str]) -> dict[str, str]:
    """Units of all groups: SI, or the drive's own for currents, where none is stated."""
    usual = {group: units[0] for group, units in UNITS.items()}
    if "i1" in columns:
        usual["tau"] = "A"
    return usual | {group: unit for group, unit in stated.items() if group in usual}
