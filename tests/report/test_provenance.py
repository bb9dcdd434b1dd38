"""Hashes of what was read."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from tauscope.errors import RecordingError
from tauscope.report.provenance import input_files, installed_version
from tauscope.robot import read_robot
from tauscope.tasks import identify, rollout
from tauscope.tasks.task import Files, record_provenance
from tauscope_sim.examples import example_robot


def test_every_file_is_hashed(tmp_path: Path) -> None:
    recording, bag = tmp_path / "a.csv", tmp_path / "bag"
    recording.write_bytes(b"t,q1,tau1\n")
    bag.mkdir()
    (bag / "metadata.yaml").write_bytes(b"x")
    (bag / "data.mcap").write_bytes(b"y")
    robot = replace(read_robot(example_robot("paper_arm")), urdf=recording)
    request = identify.Request(robot="arm.yaml", recordings=(str(recording),), held_out=(str(bag),))
    made = record_provenance(Files(), request, robot)
    assert [entry.role for entry in made.inputs] == ["robot", "urdf", "recording", "held out", "held out"]
    assert [Path(entry.path).name for entry in made.inputs[3:]] == ["data.mcap", "metadata.yaml"]
    assert made.inputs[2].sha256 == hashlib.sha256(b"t,q1,tau1\n").hexdigest()
    assert made.inputs[2].size_bytes == 10
    assert made.inputs[0].path == str(example_robot("paper_arm"))


def test_recordings_that_refine_a_model_are_hashed(tmp_path: Path) -> None:
    recording, refining = tmp_path / "a.csv", tmp_path / "b.csv"
    recording.write_bytes(b"t,q1,qref1\n")
    refining.write_bytes(b"t,q1,qref1,tau1\n")
    request = rollout.Request(robot="arm.yaml", recordings=(str(recording),), refine=(str(refining),))
    made = record_provenance(Files(), request, read_robot(example_robot("paper_arm")))
    assert [entry.role for entry in made.inputs[1:]] == ["recording", "refined by"]


def test_a_file_that_is_gone_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"gone\.csv"):
        list(input_files("recording", str(tmp_path / "gone.csv")))


def test_versions() -> None:
    assert installed_version("numpy").count(".") >= 1
    assert installed_version("no-such-package-of-anybody") == "(not installed)"
