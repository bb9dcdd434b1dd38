"""``tauscope fleet``: one table of many robots, failures in it."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.conftest import Ended
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked

Run = Callable[..., Ended]


@pytest.fixture
def manifest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three robots: one with a held-out recording, one whose recording is broken, one without a robot file."""
    monkeypatch.setattr("tauscope.cli.fleet_command.open_executor", lambda *_: InlineExecutor())
    data = unpacked(SNAPSHOTS[-1], tmp_path)
    robot = next((data / "identifications").glob("*/robot/robot.json"))
    lines = [
        "name,robot,recordings,held_out",
        f"good,{robot},data/recordings/monday.csv;data/recordings/tuesday.csv,data/recordings/wednesday.csv",
        f"broken,{robot},data/recordings/broken.csv,",
        "nowhere,no.yaml,data/recordings/monday.csv,",
    ]
    path = tmp_path / "fleet.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def rows(out: Path) -> dict[str, dict[str, str]]:
    with (out / "table.csv").open(newline="", encoding="utf-8") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("verb", ["identify", "diagnose"])
def test_one_table(verb: str, run: Run, manifest: Path, tmp_path: Path) -> None:
    ended = run("fleet", verb, manifest, "--out", tmp_path / "out")
    assert ended.status == 1
    assert "2 of 3 robots failed" in ended.err
    found = rows(tmp_path / "out")
    assert {name: row["state"] for name, row in found.items()} == {
        "good": "succeeded",
        "broken": "failed",
        "nowhere": "failed",
    }
    result = json.loads((tmp_path / "out" / "good.json").read_text(encoding="utf-8"))
    if verb == "identify":
        assert float(found["good"]["held_out_error"]) == pytest.approx(
            result["fit"]["held_out"]["relative_error"], 1e-5
        )
    else:
        assert found["good"]["verdict"] == result["verdict"]
    assert found["broken"]["error"].startswith("recording: ")
    assert found["nowhere"]["error"].startswith("robot-file: ")
    again = run("fleet", verb, manifest, "--out", tmp_path / "out")
    assert again.status == 1
    assert "exists, and is not replaced" in again.err


def test_a_manifest_that_is_not_valid_begins_nothing(run: Run, manifest: Path, tmp_path: Path) -> None:
    manifest.write_text(manifest.read_text(encoding="utf-8") + "good,a,b,c\n", encoding="utf-8")
    ended = run("fleet", "identify", manifest, "--out", tmp_path / "out")
    assert (ended.status, len(ended.err.splitlines())) == (1, 1)
    assert "line 5: name good is that of line 2 too" in ended.err
    assert not (tmp_path / "out").exists()
