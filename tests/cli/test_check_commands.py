"""``tauscope robot check``, ``recording check`` and ``recording convert``."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles, record
from emulated_data_sheet import sections, write_file
from robot.robot_texts import URDF
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope_sim.examples import example_robot

Run = Callable[..., Ended]


def test_a_robot_file_is_shown(run: Run) -> None:
    ended = run("robot", "check", example_robot("paper_arm"))
    assert (ended.status, ended.err) == (0, "")
    for words in ("paper-arm", "joint3", "-2.9 … 2.9", "2.82843 kg", "valid"):
        assert words in ended.out


def test_an_impossible_body_is_shown_with_its_repair(run: Run, tmp_path: Path) -> None:
    text = example_robot("paper_arm").read_text(encoding="utf-8")
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("{xx: 0, yy: 0.117", "{xx: 0, yy: -0.117"), encoding="utf-8")
    ended = run("robot", "check", path)
    assert (ended.status, ended.err) == (0, "")
    warning = next(line for line in ended.out.splitlines() if line.startswith(f"warning: {path}:"))
    assert "the nearest body is used: principal moments" in warning
    assert "valid" in ended.out.splitlines()[-1]


def test_names_are_shown_as_they_are(run: Run, tmp_path: Path) -> None:
    text = example_robot("paper_arm").read_text(encoding="utf-8").replace("name: paper-arm", 'name: "[red]a\\e[31m"')
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("name: joint1", 'name: "[bold]j[/bold]"'), encoding="utf-8")
    ended = run("robot", "check", path)
    if ended.status == 0:
        assert "[red]a" in ended.out
        assert "[bold]j[/bold]" in ended.out
    assert "\x1b" not in ended.out + ended.err


def test_a_recording_is_shown(run: Run, files: SimulatedFiles) -> None:
    ended = run("recording", "check", files.train[0], "--joints", "3")
    assert (ended.status, ended.err) == (0, "")
    for words in ("1000 samples", "100.00 Hz", "2 of 500 … 500 samples", "t q1 q2 q3 tau1 tau2 tau3 period", "valid"):
        assert words in ended.out


def test_findings_are_shown(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    lines = files.train[0].read_text(encoding="utf-8").splitlines(keepends=True)
    path = tmp_path / "gap.csv"
    path.write_text("".join(lines[:200] + lines[260:]), encoding="utf-8")
    ended = run("recording", "check", path)
    assert ended.status == 0
    assert "warning: t: 1 gap in the clock" in ended.out


@pytest.mark.parametrize("suffix", [".csv", ".mcap"])
def test_a_recording_is_converted(run: Run, files: SimulatedFiles, tmp_path: Path, suffix: str) -> None:
    target = tmp_path / f"copy{suffix}"
    ended = run("recording", "convert", files.train[0], target)
    assert (ended.status, ended.err) == (0, "")
    assert f"wrote {target}: 1000 samples" in ended.out
    assert ("left out: period" in ended.out) is (suffix == ".mcap")
    before, after = (read_recording(path).samples() for path in (files.train[0], target))
    np.testing.assert_allclose(after.effort, before.effort, rtol=1e-15)


def test_a_truncated_log_is_recovered_on_demand(run: Run, tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    arm = read_robot(example_robot("paper_arm"))
    source = record(arm, tmp_path / "long.csv", seed=1, periods=20)  # several chunks
    assert run("recording", "convert", source, whole).status == 0
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    target = tmp_path / "rest.csv"
    assert run("recording", "convert", cut, target).status == 1
    assert not target.exists()
    ended = run("recording", "convert", cut, target, "--recover")
    assert (ended.status, ended.err) == (0, "")
    assert "damage passed over: " in ended.out
    assert 0 < len(read_recording(target)) < 10_000


def test_recording_of_another_chain_than_the_default_one_is_refused_with_the_chain(run: Run, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "run.csv").write_text("t,q1,tau1\n0,0,0\n0.1,0,0\n", encoding="utf-8")
    ended = run("identify", tmp_path / "arm.urdf", tmp_path / "run.csv")
    assert ended.status == 1
    assert "its joints are 'shoulder', 'elbow'; where another is meant, write a robot file" in ended.err


def write_arm(folder: Path, block: str) -> Path:
    """A robot file whose drives stand on one bus."""
    path = folder / "robot.yaml"
    lines = example_robot("paper_arm").read_text(encoding="utf-8").splitlines()
    nodes = iter(range(1, 9))
    written = []
    for line in lines:
        written.append(line)
        if line.lstrip().startswith("- name: joint"):
            indent = " " * (len(line) - len(line.lstrip()) + 2)
            bus = "interface: virtual, channel: none, counts_per_turn: 4096"
            written.append(f"{indent}drive: {{node_id: {next(nodes)}, {bus}, {block}}}")
    path.write_text("\n".join(written), encoding="utf-8")
    return path


def test_the_files_of_drives_are_checked_without_a_bus(run: Run, tmp_path: Path) -> None:
    content = sections()
    del content["6072"]
    write_file(tmp_path, content)
    ended = run("robot", "check", write_arm(tmp_path, "eds: drive.eds"))
    assert (ended.status, ended.err) == (0, "")
    assert "ok: joint joint1: drive.eds has no Max torque (0x6072:00): Tauscope stops the arm" in ended.out
    for section in ("6077", "1016", "1016sub0", "1016sub1", "100C", "100D"):
        del content[section]
    write_file(tmp_path, content)
    ended = run("robot", "check", tmp_path / "robot.yaml")
    assert ended.status == 1
    for words in ("joint joint3: ", "(0x6077:00) is missing", "(0x1016:01) is missing"):
        assert words in ended.out
    assert "3 findings of 3 to mend first" in ended.err
