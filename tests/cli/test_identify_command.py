"""``tauscope identify`` from the command line to its outputs."""

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from cli.conftest import Ended
from cli.simulated_files import NOISE_STD, SimulatedFiles
from diagnosis.diagnosed_arm import only_effects
from figures import leave_figures_undrawn
from tauscope.cli.arguments import parse_cutoff
from tauscope.robot import read_robot

Run = Callable[..., Ended]


def test_the_contract_s_form(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    out = tmp_path / "result.json"
    ended = run("identify", files.robot, *files.train, "--held-out", *files.held_out, "--json", out)
    assert ended.status == 0
    assert all(line.endswith("(extrapolation)") for line in ended.err.splitlines())  # joint 2 held out moves farther
    result = json.loads(out.read_text(encoding="utf-8"))
    assert result["schema"] == "tauscope.identification/1"
    assert result["joints"] == ["joint1", "joint2", "joint3"]
    assert result["noise_std"] == pytest.approx(NOISE_STD, rel=0.15)
    assert [entry["recording"] for entry in result["conditioning"]] == [str(path) for path in files.train]
    assert [entry["recording"] for entry in result["held_out_conditioning"]] == [str(path) for path in files.held_out]
    assert result["fit"]["held_out"]["rms"] == pytest.approx(NOISE_STD, rel=0.15)
    assert len(result["links"]) == len(result["friction"]) == 3
    mass = next(entry for entry in result["base_parameters"] if entry["name"] == "m3 + 2*msx3")
    assert abs(mass["value"] - 0.7071) < 5 * mass["std"]


@pytest.mark.parametrize(
    "order",
    [
        ("ROBOT", "TRAIN", "--held-out", "HELD", "--estimator", "ls"),
        ("--held-out", "HELD", "--estimator", "ls", "ROBOT", "TRAIN"),
        ("--estimator", "ls", "--held-out", "HELD", "--", "ROBOT", "TRAIN"),
        ("ROBOT", "--estimator", "ls", "TRAIN", "--held-out", "HELD1", "--held-out", "HELD2"),
    ],
)
def test_every_order_of_words_means_the_same(run: Run, files: SimulatedFiles, order: tuple[str, ...]) -> None:
    places = {
        "ROBOT": [files.robot],
        "TRAIN": [files.train[0]],
        "HELD": list(files.held_out),
        "HELD1": [files.held_out[0]],
        "HELD2": [files.held_out[1]],
    }
    words = [word for place in order for word in places.get(place, [place])]
    ended = run("identify", "--json", "-", *words)
    assert ended.status == 0
    assert all(line.endswith("(extrapolation)") for line in ended.err.splitlines())  # joint 2 held out moves farther
    result = json.loads(ended.out)
    assert result["estimator"] == "ls"
    assert [entry["recording"] for entry in result["conditioning"]] == [str(files.train[0])]
    assert [entry["recording"] for entry in result["held_out_conditioning"]] == [str(path) for path in files.held_out]


def test_without_json_a_summary_is_shown(run: Run, files: SimulatedFiles) -> None:
    ended = run("identify", files.robot, *files.train, "--held-out", files.held_out[0])
    assert (ended.status, ended.err) == (0, "")
    for words in ("m3 + 2*msx3", "stiction", "joint3", "Relative error", "condition number", "masked samples"):
        assert words in ended.out
    assert "At every joint the residual is at the level of the sensor noise" in ended.out


def test_masked_samples_are_counted(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    header, *rows = files.train[0].read_text(encoding="utf-8").splitlines()
    for row in (100, 101, 300):
        cells = rows[row].split(",")
        cells[4] = "nan"
        rows[row] = ",".join(cells)
    recording = tmp_path / "missed.csv"
    recording.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    ended = run("identify", files.robot, recording)
    assert ended.status == 0
    assert f"! {recording}: samples left out: 3 without a torque, of 1000; " in ended.out


def test_cutoff_and_rotor_options_reach_the_identification(run: Run, files: SimulatedFiles) -> None:
    ended = run("identify", files.robot, files.train[0], "--cutoff", "12.5", "--no-rotor-inertia", "--json", "-")
    assert json.loads(ended.out)["cutoff_hz"] == 12.5
    ended = run("identify", files.robot, files.train[0], "--cutoff", "none", "--json", "-")
    assert json.loads(ended.out)["cutoff_hz"] is None


@pytest.mark.parametrize(("text", "value"), [("auto", "auto"), ("None", None), ("12.5", 12.5), ("1e2", 100.0)])
def test_cutoff_is_read(text: str, value: object) -> None:
    assert parse_cutoff(text) == value


@pytest.mark.parametrize("text", ["", "0", "-3", "nan", "inf", "ten", "1e999"])
def test_cutoff_is_refused(text: str) -> None:
    with pytest.raises(typer.BadParameter):
        parse_cutoff(text)


def test_inputs_are_never_written_to(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    hashes = {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files.everything}
    link = tmp_path / "hard-link.csv"
    os.link(files.train[0], link)
    soft = tmp_path / "soft-link.csv"
    soft.symlink_to(files.held_out[0])
    for option in ("--json", "--report"):
        for target in (files.robot, files.train[0], files.held_out[0], link, soft):
            ended = run("identify", files.robot, files.train[0], "--held-out", files.held_out[0], option, target)
            assert ended.status == 2
            assert "inputs are never written to" in ended.err
    assert hashes == {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files.everything}


def test_a_urdf_that_the_robot_names_is_an_input(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="r"><link name="base"/><link name="tip"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="joint1" type="continuous"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/></joint>'
        "</robot>"
    )
    robot = tmp_path / "robot.yaml"
    robot.write_text("name: r\nkinematics: {urdf: {file: arm.urdf, base: base, tip: tip}}\njoints: [{name: joint1}]\n")
    before = urdf.read_bytes()
    ended = run("identify", robot, files.train[0], "--json", urdf)
    assert ended.status == 2
    assert str(urdf) in ended.err
    assert urdf.read_bytes() == before


def test_outputs_appear_only_when_the_work_is_done(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    broken = tmp_path / "broken.csv"
    broken.write_text(files.train[0].read_text(encoding="utf-8").replace("\n0.5,", "\n0.5x,", 1), encoding="utf-8")
    out = tmp_path / "result.json"
    ended = run("identify", files.robot, files.train[0], "--held-out", broken, "--json", out)
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert ended.err.startswith(str(broken))
    assert ended.out == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.csv"]


def test_a_motion_that_teaches_too_little_is_told(run: Run, files: SimulatedFiles) -> None:
    ended = run("identify", files.robot, files.train[0], "--held-out", files.held_out[0])
    assert "At every joint the residual is at the level of the sensor noise" in ended.out
    assert "the model does not carry over to that motion" in ended.out


def test_the_model_is_exported(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    names = ("friction.json", "friction.yaml", "friction.h", "friction.py", "model.xml")
    options = [word for name in names for word in ("--export", tmp_path / name)]
    ended = run("identify", files.robot, *files.train, *options)
    assert (ended.status, ended.err) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    friction = json.loads((tmp_path / "friction.json").read_text(encoding="utf-8"))
    assert [joint["torque"]["stiction"] for joint in friction["joints"]] == pytest.approx([2.0, 1.0, 2.0], abs=0.05)
    hashes = [hashlib.sha256(path.read_bytes()).hexdigest() for path in files.train]
    assert [source["sha256"] for source in friction["recordings"]] == hashes
    mujoco = pytest.importorskip("mujoco")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml")).nv == 3


def test_where_one_output_cannot_be_made_none_is_written(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    out, urdf = tmp_path / "out.json", tmp_path / "arm.urdf"
    ended = run("identify", files.robot, files.train[0], "--json", out, "--export", urdf)
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_urdf_is_patched_and_the_original_stays(run: Run, shared_data: Path, tmp_path: Path) -> None:
    source = shared_data / "staubli-tx40"
    before = (source / "tx40.urdf").read_bytes()
    shutil.copy(source / "robot.yaml", tmp_path)
    out, patched = tmp_path / "out.json", tmp_path / "tx40.urdf"
    ended = run("identify", source / "robot.yaml", source / "train-1.csv", "--json", out, "--export", patched)
    assert ended.status == 0
    assert (source / "tx40.urdf").read_bytes() == before
    links = read_robot(tmp_path / "robot.yaml").model.links
    assert links is not None
    identified = json.loads(out.read_text(encoding="utf-8"))["links"]
    assert [link.mass for link in links] == pytest.approx([link["mass"] for link in identified])


def test_the_report_is_written(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    ended = run("identify", files.robot, files.train[0], "--held-out", files.held_out[0], "--report", page)
    assert (ended.status, ended.err) == (0, "")
    assert f"wrote {page}" in ended.out
    text = page.read_text(encoding="utf-8")
    assert hashlib.sha256(files.train[0].read_bytes()).hexdigest() in text
    assert f"tauscope identify {files.robot} {files.train[0]} --held-out {files.held_out[0]}" in text


def test_a_link_that_no_body_can_be_stands_first(
    run: Run, files: SimulatedFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_figures_undrawn(monkeypatch)
    link = "{mass: MASS, first_moment: [0.1, 0, 0], inertia: {xx: 0.1, yy: 0.2, zz: 0.2, xy: 0, xz: 0, yz: 0}}"
    links = ", ".join(link.replace("MASS", mass) for mass in ("1", "-1.4", "1"))
    robot = tmp_path / "robot.yaml"
    robot.write_text(files.robot.read_text(encoding="utf-8") + f"model: {{links: [{links}]}}\n", encoding="utf-8")
    words = "joint2'): mass -1.4 kg is negative; the nearest body is used: mass -1.4 → 0 kg"
    for verb in ("identify", "diagnose"):
        out, report = tmp_path / f"{verb}.json", tmp_path / f"{verb}.html"
        with only_effects(["joint_spring"]):
            ended = run(verb, robot, files.train[0], "--report", report)
        assert (ended.status, ended.err) == (0, "")
        assert words in next(line for line in ended.out.splitlines() if line.startswith("! "))
        assert "mass -1.4 → 0 kg" in report.read_text(encoding="utf-8")
        with only_effects(["joint_spring"]):
            ended = run(verb, robot, files.train[0], "--json", out)
        assert words in ended.out + ended.err
        (warning,) = [
            each
            for each in json.loads(out.read_text(encoding="utf-8"))["warnings"]
            if each["code"] == "repaired-inertial"
        ]
        assert words in warning["text"]
        assert "mass -1.4 → 0 kg" in report.read_text(encoding="utf-8")
