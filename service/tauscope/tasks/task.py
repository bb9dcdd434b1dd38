"""What all tasks share: how a request names files, how progress is told, and how outputs are made."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from pydantic import BaseModel, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from tauscope.errors import RecordingMismatchError
from tauscope.export.compensation.model import RecordingSource
from tauscope.export.model import Origin
from tauscope.recording import EffortKind, Reading, Recording, flow_text, open_recording
from tauscope.remote_files import find_path
from tauscope.report.provenance import InputFile, Provenance, input_files, versions
from tauscope.robot import RecordingLayout, Robot, find_column_fault, find_fault, find_separator_fault
from tauscope.robot.recording_layout import PRESETS, UNITS
from tauscope.strict_model import StrictModel

# Name of each input of a request in a report.
ROLES = {
    "recordings": "recording",
    "held_out": "held out",
    "refine": "refined by",
    "simulated": "compared with",
    "model": "compared with",
}


class TaskRequest(StrictModel):
    """A request that names recordings, and perhaps a model."""

    robot: str = Field(description="robot file")
    options: Any

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same: the verb is the name of its module."""
        verb = type(self).__module__.rpartition(".")[2]
        own = {name: value for name, value in self if name not in ("robot", "options") and value is not None}
        asked = {
            name.removesuffix("_hz"): value for name, value in self.options if name not in ReadingOptions.model_fields
        }
        return command_words(verb, self.robot, **own, **asked, **self.options.words)

    @property
    def inputs(self) -> dict[str, tuple[str, ...]]:
        """Names of its files by role, without the robot file."""
        named = {role: getattr(self, role, None) or () for role in ROLES}
        return {role: (names,) if isinstance(names, str) else names for role, names in named.items()}


class ReadingOptions(StrictModel):
    """How the recordings of a request are read."""

    units: dict[str, str] | None = Field(
        default=None,
        description="unit of the columns that are not in SI: "
        + "; ".join(f"{column} ({', '.join(units)})" for column, units in UNITS.items())
        + "; or of one joint's column, as q3; null: as the robot file and the columns' names say",
        examples=[{"q": "deg", "t": "ms"}],
    )
    rate_hz: float | None = Field(
        default=None, gt=0.0, allow_inf_nan=False, description="samples a second where t counts samples [Hz]"
    )
    trust_units: bool = Field(
        default=False, description="whether a recording is used that can hardly be in the stated units"
    )
    columns: str | dict[str, str | int | list[str | int]] | None = Field(
        default=None,
        description=f"where the columns are found, where they have other names: a preset ({', '.join(PRESETS)}), or "
        "for t, q, tau, i, qd, … or one joint's, as q3, the file's column, its number from 1, one of them a joint, or "
        "a name with {0}, {1} or {name} for the joint; null: as the robot file says",
        examples=[{"t": "timestamp", "q": "actual_q_{0}", "tau": "target_moment_{0}"}],
    )
    decimal: str | None = Field(default=None, description="decimal sign of a CSV; null: detected")
    delimiter: str | None = Field(
        default=None, description="delimiter of a CSV: comma, semicolon, tab, blank or |; null: detected"
    )
    topic: str | None = Field(default=None, description="topic of a log that has several with joint states")

    @field_validator("units")
    @classmethod
    def _check_units(cls, units: dict[str, str] | None) -> dict[str, str] | None:
        """Units that are known; the rate may be in the robot file."""
        fault = find_fault(units or {}, 1.0 if (units or {}).get("t") == "index" else None)
        if fault is not None:
            raise PydanticCustomError("units", "{text}", {"text": fault[1]})
        return units

    @field_validator("columns")
    @classmethod
    def _check_columns(cls, columns: Any) -> Any:
        """A preset that is known, or columns of a recording."""
        fault = find_column_fault(columns)
        if fault is not None:
            raise PydanticCustomError("columns", "{text}", {"text": fault})
        return columns

    @field_validator("decimal", "delimiter")
    @classmethod
    def _check_separator(cls, sign: str | None, info: ValidationInfo) -> str | None:
        fault = find_separator_fault(**{"decimal": None, "delimiter": None, str(info.field_name): sign})
        if fault is not None:
            raise PydanticCustomError("separator", "{text}", {"text": fault[1]})
        return sign

    @property
    def reading(self) -> Reading:
        """The same for those who read."""
        layout = {each.name: getattr(self, each.name) for each in fields(RecordingLayout)}
        return Reading(**{**layout, "units": self.units or {}}, trust_units=self.trust_units)

    @property
    def words(self) -> dict[str, Any]:
        """Options of a command line, those that are not as by default."""
        words = {
            "units": ",".join(f"{column}={unit}" for column, unit in (self.units or {}).items()) or None,
            "rate": self.rate_hz,
            "trust_units": self.trust_units or None,
            "columns": flow_text(self.columns) if isinstance(self.columns, dict) else self.columns,
            "decimal": self.decimal,
            "delimiter": self.delimiter,
            "topic": self.topic,
        }
        return {name: value for name, value in words.items() if value is not None}


class Progress(Protocol):
    """Hears which step goes on; may raise to end the task."""

    def __call__(self, step: str, percent: float | None = None, figures: Mapping[str, Any] = {}, /) -> None:
        """Hear of a step, or of how far it is. `percent`: how much is done; None at the beginning of a step."""
        ...


class Files:
    """Where the files of a request lie: here by their paths, as on a command line; and what a result calls them."""

    def __init__(self, targets: Mapping[str, Path] = {}) -> None:
        self._targets = targets

    def find(self, role: str, name: str) -> Path:
        """Where an input lies. Raises RecordingError where it is not what was asked for."""
        return find_path(name)

    def show(self, path: Path) -> str:
        """What reports call an input."""
        return str(path)

    def target(self, output: str) -> Path | None:
        """Where an output is written; None where it is not wanted."""
        return self._targets.get(output)


class Outputs(Mapping[str, bytes]):
    """Files that a task can write, by name, each made when asked for; ExportError where a format is too poor."""

    def __init__(self, make: Mapping[str, Callable[[], str | bytes]]) -> None:
        self._make = make

    def __getitem__(self, name: str) -> bytes:
        made = self._make[name]()
        return made.encode() if isinstance(made, str) else made

    def __contains__(self, name: object) -> bool:
        """Whether there is such an output: asked of `Mapping`, it would be made for the answer."""
        return name in self._make

    def __iter__(self) -> Iterator[str]:
        return iter(self._make)

    def __len__(self) -> int:
        return len(self._make)


def json_text(document: BaseModel, indent: int | None = 1) -> str:
    """A document as its file holds it."""
    return document.model_dump_json(by_alias=True, indent=indent) + "\n"


def read_recordings(
    files: Files, role: str, names: Sequence[str], robot: Robot, options: ReadingOptions
) -> tuple[Recording, ...]:
    """Recordings of a robot, called as the request calls them; those of a simulator are in SI."""
    reading = options.reading
    if role == "simulated":
        robot, reading = replace(robot, recording=RecordingLayout()), Reading(trust_units=options.trust_units)
    paths = [files.find(role, name) for name in names]
    read = [_open(path, robot, reading) for path in paths]
    return tuple(
        recording if str(path) == name else replace(recording, name=name)
        for recording, path, name in zip(read, paths, names, strict=True)
    )


def _open(path: Path, robot: Robot, reading: Reading) -> Recording:
    """A recording of a robot; where it has other joints than a chain that nobody chose, the reason names the chain."""
    try:
        return open_recording(path, robot, reading)
    except RecordingMismatchError as error:
        chosen = [f"{note.text}; {note.remedy}" for note in robot.notes if note.code == "default-chain"]
        raise RecordingMismatchError("; ".join([str(error), *chosen])) from error


def record_provenance(files: Files, request: TaskRequest, robot: Robot) -> Provenance:
    """Hash all inputs and note the versions. Raises RecordingError where a file cannot be read any more."""
    paths = list(robot.files)
    paths += [(ROLES[role], files.find(role, name)) for role, names in request.inputs.items() for name in names]
    hashed = [
        InputFile(role, files.show(Path(file.path)), file.size_bytes, file.sha256)
        for role, path in paths
        for file in input_files(role, str(path))
    ]
    return Provenance(request.command, tuple(hashed), versions(), datetime.now(UTC))


@dataclass(frozen=True, eq=False)
class TaskResult:
    """What came of a task that reads recordings."""

    request: Any
    files: Files
    robot: Robot
    recordings: tuple[Recording, ...]

    @cached_property
    def provenance(self) -> Provenance:
        """What the result was made from, and when."""
        return record_provenance(self.files, self.request, self.robot)

    @property
    def origin(self) -> Origin:
        """Where a model comes from, for its exports; its effort is current where any recording holds current."""
        holds_current = any(recording.effort_kind is EffortKind.CURRENT for recording in self.recordings)
        entries, robot = self.provenance.inputs, self.robot
        return Origin(
            sources=tuple(RecordingSource(entry.path, entry.sha256) for entry in entries if entry.role == "recording"),
            effort_kind=EffortKind.CURRENT if holds_current else EffortKind.TORQUE,
            created=self.provenance.created,
            urdf=None if robot.urdf is None else robot.urdf.read_bytes(),
            is_mjcf=robot.mjcf is not None,
        )


def command_words(verb: str, robot: str, **options: Any) -> tuple[str, ...]:
    """The command line that does the same, each of `options` spelled out but outputs; empty tuples are left out."""
    words = ["tauscope", verb, robot]
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        match value:
            case tuple():
                words += [*([option] if value and name != "recordings" else []), *map(str, value)]
            case bool():
                words.append(option if value else f"--no-{option[2:]}")
            case _:
                words += [option, "none" if value is None else str(value)]
    return tuple(words)
