"""``tauscope diagnose`` from the files to its document; the parser is the program's own."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import tauscope.tasks.diagnose
from diagnosis.diagnosed_arm import only_effects, recordings
from diagnosis.test_diagnosis_of_simulated_arms import spring
from figures import leave_figures_undrawn
from tauscope.cli.diagnose_command import diagnose
from tauscope.cli.verbs import SeveralValuesCommand, add_verb
from tauscope.diagnosis import Diagnosis, DiagnosisDocument
from tauscope.errors import ExcitationError
from tauscope.excitation import require_within_limits
from tauscope.export.model_file import read_extended_model
from tauscope.headroom.learners import LEARNERS
from tauscope.recording import Recording
from tauscope.robot import read_robot
from tauscope.trajectory import motion_limits, read_trajectory
from tauscope_sim.examples import example_robot
from tauscope_sim.scenario_file import read_scenario

app = typer.Typer()
add_verb(app, diagnose, SeveralValuesCommand)


def written(folder: Path, name: str, recording: Recording) -> Path:
    samples = recording.samples()
    assert samples.period is not None
    columns = [samples.time[:, None], samples.position, samples.effort, samples.period[:, None]]
    header = "t,q1,q2,q3,tau1,tau2,tau3,period"
    path = folder / f"{name}.csv"
    np.savetxt(path, np.hstack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module", autouse=True)
def few_effects() -> Iterator[None]:
    with only_effects(["joint_spring"]):
        yield


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("recordings")
    made = recordings((1, 2), spring, np.random.default_rng(5))
    return [str(written(folder, f"motion-{place}", each)) for place, each in enumerate(made)]


def run(*words: str) -> tuple[int, str]:
    result = CliRunner(env={"COLUMNS": "400"}).invoke(app, [str(example_robot("paper_arm")), *words])
    return result.exit_code, result.output


@dataclass(frozen=True)
class Written:
    """One run of the command with every output."""

    status: int
    shown: str
    out: dict[str, Path]
    found: Diagnosis


@pytest.fixture(scope="module")
def written_once(files: list[str], tmp_path_factory: pytest.TempPathFactory) -> Written:
    folder = tmp_path_factory.mktemp("outputs")
    names = ["out.json", "model.json", "code.py", "code.h", "scenario.yaml", "robot.yaml", "next.json", "page.html"]
    out = {name: folder / name for name in names}
    found: list[Diagnosis] = []
    monkeypatch = pytest.MonkeyPatch()
    diagnose = tauscope.tasks.diagnose.diagnose
    monkeypatch.setattr("tauscope.tasks.diagnose.diagnose", lambda *of: found.append(diagnose(*of)) or found[0])
    monkeypatch.setattr("tauscope.headroom.joint_headroom.LEARNERS", LEARNERS[:1])  # how much it learns is not asked
    monkeypatch.setattr("tauscope.headroom.learners.TREES", (2, 5))
    leave_figures_undrawn(monkeypatch)
    status, shown = run(
        files[0],
        *("--held-out", files[1], "--headroom", "--json", str(out["out.json"])),
        *("--model", str(out["model.json"]), "--export", str(out["code.py"]), "--export", str(out["code.h"])),
        *("--scenario", str(out["scenario.yaml"]), "--improved-robot", str(out["robot.yaml"])),
        *("--next-trajectory", str(out["next.json"]), "--report", str(out["page.html"])),
    )
    monkeypatch.undo()
    return Written(status, shown, out, found[0])


def test_the_document_is_written(written_once: Written) -> None:
    assert written_once.status == 0, written_once.shown
    text = written_once.out["out.json"].read_text()
    found = DiagnosisDocument.model_validate_json(text)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("joint_spring", "joint1")]
    assert json.loads(text)["schema"] == "tauscope.diagnosis/1"
    assert [each.joint for each in found.headroom or ()] == ["joint1", "joint2", "joint3"]


@pytest.fixture
def found_before(written_once: Written, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the same recording said once: a diagnosis takes seconds."""
    monkeypatch.setattr("tauscope.tasks.diagnose.diagnose", lambda *_: written_once.found)


@pytest.mark.usefixtures("found_before")
def test_a_terminal_shows_verdict_and_statement(files: list[str]) -> None:
    status, shown = run(files[0])
    assert status == 0
    assert "explained" in shown
    assert shown.splitlines()[0].startswith("Robot paper-arm: A 0.")
    assert " Nm/rad spring is missing at joint1 (" in shown
    assert "Add a spring to the joint." in shown
    assert "Noise: from differences between repeated periods" in shown


@pytest.mark.usefixtures("found_before")
def test_everything_that_can_be_written_is_written_and_read_again(written_once: Written, files: list[str]) -> None:
    out = written_once.out
    arm = read_robot(example_robot("paper_arm"))
    saved = read_extended_model(out["model.json"], arm)
    assert [term.effect.id for term in saved.terms] == ["joint_spring"]
    improved = read_robot(out["robot.yaml"])
    require_within_limits(read_trajectory(out["next.json"], arm), arm, motion_limits(arm))
    assert "joint_spring" in [each.effect_id for each in read_scenario(out["scenario.yaml"], improved).effects]
    page = out["page.html"].read_text()
    assert page.count("<figure") == 2 + 1 + 3 + 1  # maps before and after, shifts, proof by joint, the next motion
    assert "tauscope diagnose" in page
    assert " --headroom" in page
    assert "explained" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    compile(out["code.py"].read_text(), "code.py", "exec")
    status, shown = run(files[0], "--against", str(out["model.json"]))
    assert status == 0
    assert "consistent" in shown


@pytest.mark.usefixtures("found_before")
def test_limits_that_allow_no_next_experiment_cost_nobody_the_diagnosis(
    files: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise ExcitationError("joint1: no room; relax its limits")

    monkeypatch.setattr("tauscope.tasks.diagnose.planned_experiment", refused)
    out, motion = tmp_path / "out.json", tmp_path / "next.json"
    status, shown = run(files[0], "--json", str(out), "--next-trajectory", str(motion))
    assert status == 1
    assert DiagnosisDocument.model_validate_json(out.read_text()).findings
    assert not motion.exists()
    assert f"wrote {out}" in shown
    assert str(motion) not in shown


def test_a_suffix_that_names_nothing_is_wrong_usage(files: list[str], tmp_path: Path) -> None:
    for option, name in (("--export", "code.rs"), ("--next-trajectory", "next.txt")):
        status, shown = run(*files[:1], option, str(tmp_path / name))
        assert status == 2
        assert name in shown


def test_against_the_model_wrong_values_and_missing_structure_are_told_apart(files: list[str], tmp_path: Path) -> None:
    robot = tmp_path / "wrong.yaml"
    text = example_robot("paper_arm").read_text()
    robot.write_text(
        text.replace("{stiction: 1.0, stribeck: -0.2, viscous: 0.277}", "{stiction: 1.0, stribeck: -0.2, viscous: 0.1}")
    )
    out = tmp_path / "out.json"
    result = CliRunner().invoke(app, [str(robot), files[0], "--against", "model", "--json", str(out)])
    assert result.exit_code == 0
    found = DiagnosisDocument.model_validate_json(out.read_text())
    assert found.against == "model"
    assert "joint_spring" in [finding.effect for finding in found.findings]
    wrong = {entry.parameter: entry for entry in found.parameter_differences}
    assert wrong["viscous joint2"].simulation == 0.1
    assert wrong["viscous joint2"].real == pytest.approx(0.277, abs=0.05)


def test_against_something_that_is_no_file_is_wrong_usage(files: list[str]) -> None:
    status, shown = run(*files, "--against", "nothing-of-this-name.csv")
    assert status == 2
    assert "nothing-of-this-name.csv" in shown


def test_an_input_is_never_overwritten(files: list[str]) -> None:
    before = Path(files[0]).read_bytes()
    status, _ = run(*files, "--json", files[0])
    assert status == 2
    assert Path(files[0]).read_bytes() == before
