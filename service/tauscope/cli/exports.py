"""``--export FILE``: the model for a controller or a simulator, in the format that the file's suffix names."""

from collections.abc import Sequence
from pathlib import Path

import typer

from tauscope.export.compensation import RecordingSource
from tauscope.export.formats import ExportFormat, ExportInput, make_export
from tauscope.identification import Identification
from tauscope.recording import EffortKind, Recording
from tauscope.report.provenance import Provenance
from tauscope.robot import Robot

SUFFIXES = {
    ".json": ExportFormat.JSON,
    ".yaml": ExportFormat.YAML,
    ".yml": ExportFormat.YAML,
    ".h": ExportFormat.C,
    ".py": ExportFormat.PYTHON,
    ".urdf": ExportFormat.URDF,
    ".xml": ExportFormat.MJCF,
    ".mjcf": ExportFormat.MJCF,
}
"""Formats by suffix."""


def export_format(path: Path) -> ExportFormat:
    """The format that a file name asks for.

    Raises
    ------
    typer.BadParameter
        where its suffix names no format
    """
    try:
        return SUFFIXES[path.suffix.lower()]
    except KeyError:
        known = ", ".join(SUFFIXES)
        raise typer.BadParameter(
            f"{str(path)!r}: the suffix names no format; use {known}", param_hint="'--export'"
        ) from None


def make_exports(
    paths: Sequence[Path], identification: Identification, recordings: Sequence[Recording], provenance: Provenance
) -> dict[Path, bytes]:
    """The content of every file that ``--export`` asks for.

    Raises
    ------
    ExportError
        where a format cannot hold the model
    """
    sources = [RecordingSource(entry.path, entry.sha256) for entry in provenance.inputs if entry.role == "recording"]
    holds_current = any(recording.effort_kind is EffortKind.CURRENT for recording in recordings)
    given = ExportInput(
        identification=identification,
        sources=sources,
        effort_kind=EffortKind.CURRENT if holds_current else EffortKind.TORQUE,
        urdf=_urdf(identification.robot),
        created=provenance.created,
    )
    return {path: make_export(export_format(path), given) for path in paths}


def _urdf(robot: Robot) -> bytes | None:
    """The URDF that the chain comes from, as it is."""
    return None if robot.urdf is None else robot.urdf.read_bytes()
