"""``tauscope rollout`` from the command line to its outputs."""

import json
from collections.abc import Callable
from pathlib import Path

from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles

Run = Callable[..., Ended]


def test_model_json_and_report(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    model, out, page = (tmp_path / name for name in ("model.json", "out.json", "page.html"))
    assert run("identify", files.robot, *files.train, "--model", model).status == 0
    ended = run("rollout", files.robot, files.held_out[0], "--model", model, "--json", out, "--report", page)
    assert ended.status == 0
    assert "Position error" in ended.out  # outputs never silence the terminal
    result = json.loads(out.read_text(encoding="utf-8"))
    assert result["schema"] == "tauscope.rollout/1"
    assert result["drive"] == "torque"
    (summary,) = result["summary"]
    assert summary["model"] == "identified"
    assert max(summary["rms"]) < 0.2
    assert "Motion where the error is largest" in page.read_text(encoding="utf-8")


def test_a_robot_without_a_model_is_refused(run: Run, files: SimulatedFiles) -> None:
    ended = run("rollout", files.robot, files.held_out[0])
    assert ended.status == 1
    assert "--model MODEL.json" in ended.err


def test_a_refinement_without_commands_is_refused(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    assert run("identify", files.robot, *files.train, "--model", model).status == 0
    ended = run("rollout", files.robot, files.held_out[0], "--model", model, "--refine", *files.train)
    assert ended.status == 1
    assert "a refinement needs commands" in ended.err
    assert len(ended.err.splitlines()) == 1


def test_standard_output_holds_json_alone(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    assert run("identify", files.robot, *files.train, "--model", model).status == 0
    ended = run("rollout", files.robot, files.held_out[0], "--model", model, "--json", "-")
    assert json.loads(ended.out)["robot"]
