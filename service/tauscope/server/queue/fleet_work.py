"""What a worker does for one robot of a fleet: files in, a result file and a row out."""

from collections.abc import Callable, Sequence
from pathlib import Path

from pydantic import BaseModel

from tauscope.diagnosis import diagnose
from tauscope.diagnosis import document as diagnosis_document
from tauscope.errors import TauscopeError
from tauscope.files import write_atomically
from tauscope.identification import Options, document, identify
from tauscope.recording import Recording, read_recording
from tauscope.robot import Robot, read_robot
from tauscope.server.queue.fleet import FleetEntry, FleetResult, timed

IDENTIFICATION_COLUMNS = ("relative_error", "held_out_error", "condition_number", "constrained")
DIAGNOSIS_COLUMNS = ("verdict", "findings")


def identify_robot(entry: FleetEntry, folder: Path) -> FleetResult:
    """Identify a robot."""
    return timed(lambda: _guarded(entry, lambda: _identified(entry, folder)))


def diagnose_robot(entry: FleetEntry, folder: Path) -> FleetResult:
    """Diagnose a robot, against the best model that its recordings allow."""
    return timed(lambda: _guarded(entry, lambda: _diagnosed(entry, folder)))


def _identified(entry: FleetEntry, folder: Path) -> dict[str, str]:
    """Identify, and write the result."""
    robot, recordings, held_out = _inputs(entry)
    found = document(identify(robot, recordings, held_out, Options()))
    _write(found, folder / f"{entry.name}.json")
    judged = found.fit.held_out
    return {
        "relative_error": f"{found.fit.train.relative_error:.6g}",
        "held_out_error": "" if judged is None else f"{judged.relative_error:.6g}",
        "condition_number": f"{found.condition_number:.6g}",
        "constrained": str(found.constrained).lower(),
    }


def _diagnosed(entry: FleetEntry, folder: Path) -> dict[str, str]:
    """Diagnose, and write the result."""
    robot, recordings, held_out = _inputs(entry)
    found = diagnosis_document(diagnose(robot, recordings, held_out, Options()))
    _write(found, folder / f"{entry.name}.json")
    findings = (f"{each.effect}@{each.joint}" if each.joint else each.effect for each in found.findings)
    return {"verdict": found.verdict, "findings": "; ".join(findings)}


def _inputs(entry: FleetEntry) -> tuple[Robot, list[Recording], list[Recording]]:
    """The robot and its recordings."""
    robot = read_robot(entry.robot)
    names = [joint.name for joint in robot.joints]

    def read(paths: Sequence[Path]) -> list[Recording]:
        return [read_recording(path, robot.joint_count, names) for path in paths]

    return robot, read(entry.recordings), read(entry.held_out)


def _write(found: BaseModel, path: Path) -> None:
    """Write a result."""
    write_atomically(path, (found.model_dump_json(by_alias=True, indent=1) + "\n").encode())


def _guarded(entry: FleetEntry, work: Callable[[], dict[str, str]]) -> FleetResult:
    """A failure that Tauscope foresees is a row of the table."""
    try:
        return FleetResult(entry, work(), None)
    except TauscopeError as error:
        return FleetResult(entry, {}, f"{error.code}: {error}")
    except OSError as error:
        return FleetResult(entry, {}, f"{error.filename or entry.name}: {error.strerror or error}")
