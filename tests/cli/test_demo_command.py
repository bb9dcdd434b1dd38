"""``tauscope demo``."""

import json
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from unittest.mock import Mock
from urllib.request import urlopen

import numpy as np
import pytest

from cli.conftest import Ended
from tauscope.cli import demo_command
from tauscope.cli.demo_command import (
    FILES,
    HELD_OUT,
    HELD_OUT_TRAJECTORY,
    NOISE_STD_NM,
    REPORT,
    RESULT,
    ROBOT,
    TRAIN,
    TRAIN_TRAJECTORY,
    robot_text_without_model,
)
from tauscope.cli.demo_page import DATA, MARK, PORT, PageShown, leave_page, prepare_folder
from tauscope.errors import ExportError, StoreError
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope.trajectory import read_trajectory
from tauscope_sim.examples import example_robot

Run = Callable[..., Ended]


def in_whole_demo(test: Callable[..., None]) -> Callable[..., None]:
    """A whole proof, whose guards are `make demo`, run by the check of a change, and tests/browser/test_story.py."""
    return pytest.mark.proof(pytest.mark.timeout(1800)(test))


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The demo's folder and what it printed, run as a program of its own."""
    folder = tmp_path_factory.mktemp("demo") / "out"
    command = [sys.executable, "-m", "tauscope.cli", "demo", "--no-page", "--out", str(folder)]
    ended = subprocess.run(command, check=False, capture_output=True, text=True, timeout=800)
    assert (ended.returncode, ended.stderr) == (0, "")
    return folder, ended.stdout


@pytest.mark.parametrize(
    ("is_terminal", "asked", "shown"),
    [
        (True, None, PageShown.HERE),
        (False, None, PageShown.LEFT),
        (True, False, PageShown.NOT),
        (False, True, PageShown.HERE),
    ],
)
def test_it_ends_with_a_running_page_unless_none_is_wanted(
    monkeypatch: pytest.MonkeyPatch, is_terminal: bool, asked: bool | None, shown: PageShown
) -> None:
    said: list[PageShown] = []
    monkeypatch.setattr("tauscope.cli.demo_command.run_demo", lambda _, page: said.append(page))
    monkeypatch.setattr(sys, "stdout", Mock(isatty=lambda: is_terminal))
    demo_command.demo(Path("out"), asked)
    assert said == [shown]


@in_whole_demo
def test_the_page_has_the_finished_campaign_at_another_port_where_its_own_is_taken(demo: tuple[Path, str]) -> None:
    folder = str(demo[0])
    code = f"from pathlib import Path; from tauscope.cli.demo_page import show_page; show_page(Path({folder!r}))"
    with port_taken(PORT), subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as service:
        assert service.stdout is not None
        address = service.stdout.readline().split()[2].rstrip(",")
        with urlopen(f"{address}/api/v1/campaigns", timeout=60) as answer:
            (campaign,) = json.load(answer)["campaigns"]
        service.send_signal(signal.SIGINT)
    assert campaign["state"] == "succeeded"
    assert not address.endswith(f":{PORT}")


@pytest.mark.slow
@pytest.mark.parametrize("end", ["in time", "another demo", "folder gone"])
def test_a_page_that_is_left_ends_by_itself(tmp_path: Path, end: str) -> None:
    folder = tmp_path / "demo"
    prepare_folder(folder, (*FILES, DATA))
    page = leave_page(folder, 5.0 if end == "in time" else 300.0)
    with urlopen(f"{page.address}/healthz", timeout=60) as answer:
        assert answer.status == 200
    if end == "another demo":
        prepare_folder(folder, (*FILES, DATA))
    elif end == "folder gone":
        folder.rename(tmp_path / "elsewhere")
    with page.process:  # which waits for its end
        pass
    assert page.process.returncode == -signal.SIGINT, "asked to end as by Ctrl-C, and ended in order"


@pytest.mark.slow
def test_a_page_that_does_not_come_up_says_why(tmp_path: Path) -> None:
    (tmp_path / DATA).write_text("not a folder")
    with pytest.raises(StoreError, match=f"{DATA}.*tauscope serve"):
        leave_page(tmp_path)


@contextmanager
def port_taken(port: int) -> Iterator[None]:
    """By us, or by whoever has it."""
    with socket.socket() as holder:
        with suppress(OSError):
            holder.bind(("127.0.0.1", port))
            holder.listen()
        yield


@in_whole_demo
def test_everything_is_there_and_named(demo: tuple[Path, str]) -> None:
    folder, printed = demo
    assert sorted(path.name for path in folder.iterdir()) == sorted([MARK, *FILES, DATA])
    for name in FILES:
        assert f"wrote {folder / name}\n" in printed


@in_whole_demo
def test_the_result_holds_the_truth(demo: tuple[Path, str]) -> None:
    folder, _ = demo
    result = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    truth = {"Ixx3 - Iyy3 - 0.5*msx3": 2**0.5 / 24, "m3 + 2*msx3": 0.5**0.5, "m2 + 2*msx2 - 2*msx3": 2**0.5}
    found = {entry["name"]: entry for entry in result["base_parameters"]}
    for name, value in truth.items():
        assert abs(found[name]["value"] - value) < 4 * found[name]["std"]
    assert [entry["stiction"] for entry in result["friction"]] == pytest.approx([2.0, 1.0, 2.0], abs=0.15)
    assert result["noise_std"] == pytest.approx(NOISE_STD_NM, rel=0.05)
    assert result["fit"]["held_out"]["rms"] == pytest.approx(NOISE_STD_NM, rel=0.05)


@in_whole_demo
def test_the_identification_is_not_told_the_truth(demo: tuple[Path, str]) -> None:
    folder, _ = demo
    robot = read_robot(folder / ROBOT)
    assert robot.model.links is None
    assert robot.model.friction is None
    arm = read_robot(example_robot("paper_arm"))
    assert [joint.limits for joint in robot.joints] == [joint.limits for joint in arm.joints]
    assert "model:" not in robot_text_without_model(example_robot("paper_arm"))
    for name in (TRAIN_TRAJECTORY, HELD_OUT_TRAJECTORY):
        trajectory = read_trajectory(folder / name, robot)
        assert trajectory.design is not None
        assert None in trajectory.design.margins.get("torque", (None,))


@in_whole_demo
def test_recordings_are_of_different_motions(demo: tuple[Path, str]) -> None:
    folder, _ = demo
    train, held_out = (read_recording(folder / name).samples() for name in (TRAIN, HELD_OUT))
    assert len(train.position) > 200 * 50
    assert len(held_out.position) > 200 * 20
    assert np.abs(train.position[:4000] - held_out.position[:4000]).max() > 0.5
    assert np.abs(train.effort[:4000] - held_out.effort[:4000]).min(axis=0).max() > 0.0


@in_whole_demo
def test_z_scores_are_printed_and_plausible(demo: tuple[Path, str]) -> None:
    _, printed = demo
    line = next(line for line in printed.splitlines() if line.startswith("z is"))
    rms = float(line.split(" is ")[-1].split()[0])
    assert 0.5 < rms < 1.6
    assert (demo[0] / REPORT).stat().st_size < 3_000_000


@in_whole_demo
def test_the_concealed_spring_is_found_and_the_page_can_show_it(demo: tuple[Path, str]) -> None:
    folder, printed = demo
    assert "spring is missing at joint1" in printed
    assert "verdict: explained" in printed
    assert f"tauscope serve --data {folder / DATA}" in printed
    (result,) = (folder / DATA / "diagnoses").glob("*/result.json")
    found = json.loads(result.read_text(encoding="utf-8"))
    assert [(each["effect"], each["joint"]) for each in found["findings"]] == [("joint_spring", "joint1")]
    (stiffness,) = (each for each in found["findings"][0]["parameters"] if each["name"] == "k")
    assert abs(stiffness["value"] - 0.6) < 5 * stiffness["std"]


def test_the_folder_of_a_service_stays(tmp_path: Path) -> None:
    prepare_folder(tmp_path, (*FILES, DATA))
    (tmp_path / DATA).mkdir()
    (tmp_path / DATA / "mine").write_text("a campaign")
    prepare_folder(tmp_path, (*FILES, DATA))
    assert (tmp_path / DATA / "mine").read_text() == "a campaign"


def test_it_replaces_its_own_files_only(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    prepare_folder(tmp_path, FILES)
    (tmp_path / TRAIN).write_text("of the demo")
    prepare_folder(tmp_path, FILES)
    assert not (tmp_path / TRAIN).exists()
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", [TRAIN, MARK])
def test_somebody_else_s_file_of_the_same_name_stays(run: Run, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(ExportError, match=name):
        prepare_folder(tmp_path, FILES)
    ended = run("demo", "--out", tmp_path)
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "mine"
