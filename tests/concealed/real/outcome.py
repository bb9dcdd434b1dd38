"""One trial on real recordings: changed, sealed, diagnosed apart, opened, compared."""

import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

from concealed.real.editing import Edit
from concealed.real.trials import REAL, Real, data
from concealed.running.kept import Outcome
from concealed.scoring.plain import plain
from concealed.scoring.score import compared
from concealed.sealing.sealed import diagnosis_apart
from concealed.sealing.truth import Hidden, Truth, opened
from tauscope.recording import read_recording, write_recording
from tauscope.robot import read_robot

MODEL = "model.json"


def real_outcome(name: str) -> Outcome:
    """What the diagnosis says of the trial of a name."""
    told, source = REAL[name], data() / REAL[name].recordings
    with (
        tempfile.TemporaryDirectory(prefix="concealed-") as where,
        tempfile.TemporaryDirectory(prefix="vault-") as vault,
    ):
        folder, sealed = Path(where), Path(vault) / "truth.json"
        truth = truth_of_real(told, source)
        seal = truth.seal(sealed)
        print(f"sealed real {name} {seal}", flush=True)
        more: tuple[str, ...] = ()
        if told.against_model:
            _lay_out(None, source, folder)
            diagnosis_apart(folder, more=("--model", MODEL))
            more = ("--against", MODEL)
        _lay_out(told.edit and told.edit(), source, folder)
        found, seconds = diagnosis_apart(folder, more=more)
        score = compared(opened(sealed, seal), found, seconds)
    case: dict[str, Any] = {"places": [], "arm": told.recordings, "wanted": 0.0, "words": told.words}
    return {
        "name": f"real-{name}",
        "case": case,
        "seal": seal,
        "truth": asdict(truth),
        "score": asdict(score),
        "seconds": seconds,
        "diagnosis": plain(found),
    }


def truth_of_real(told: Real, source: Path) -> Truth:
    """What is concealed, or what the authors found."""
    robot = read_robot(source / "robot.yaml")
    joints: list[str | None] = [label.partition("@")[2] or None for label in told.labels]
    hidden = [Hidden(list(told.labels), [], joints, dict(told.parameters))] if told.labels else []
    return Truth({"words": told.words}, hidden, float("nan"), [1.0] * robot.joint_count)


def _lay_out(edit: Edit | None, source: Path, folder: Path) -> None:
    """The robot's files and the changed recordings, as a user would have them."""
    robot = read_robot(source / "robot.yaml")
    for path in [*source.glob("*.yaml"), *source.glob("*.urdf")]:
        shutil.copy(path, folder / path.name)
    for path in sorted([*source.glob("train-*.csv"), *source.glob("held-out-*.csv")]):
        (folder / path.name).unlink(missing_ok=True)
        recording = read_recording(path)
        write_recording(recording if edit is None else edit(robot, recording), folder / path.name)
