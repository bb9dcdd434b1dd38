"""``tauscope campaign``: from a robot file to its model, in one process and without a service."""

import json
from pathlib import Path

import pytest

from tauscope.cli import main
from tauscope.diagnosis import DiagnosisDocument
from tauscope.identification import IdentificationDocument
from tauscope_sim.examples import example_robot

QUICK = {"starts": 1, "periods": 2, "slow_postures": 1, "closing_period": False}
SCENARIO = {"effects": [{"effect": "joint_spring", "joint": 1, "stiffness": 0.6}], "torque_noise_std": [0.5, 0.3, 0.7]}


@pytest.mark.proof
def test_motions_recordings_and_results_are_kept(tmp_path: Path) -> None:
    out = tmp_path / "campaign"
    words = ["campaign", str(example_robot("paper_arm")), "--out", str(out), "--diagnosis", "{}"]
    words += ["--backend", json.dumps({"name": "sim", "scenario": SCENARIO}), "--excitation", json.dumps(QUICK)]
    words += ["--held-out", '{"periods": 1}', "--run", '{"rate_hz": 200.0, "feed_forward": false}']
    assert main(words) == 0
    document = IdentificationDocument.model_validate_json((out / "identification/result.json").read_text())
    assert document.fit.held_out is not None
    assert (out / "identification/exports/friction.h").is_file()
    found = DiagnosisDocument.model_validate_json((out / "diagnosis/result.json").read_text())
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("joint_spring", "joint1")]
    assert {"train.json", "train.csv", "held-out.json", "held-out.csv"} <= {path.name for path in out.iterdir()}
    assert main(words) == 1  # a folder is never written over


@pytest.mark.parametrize(("option", "text"), [("--held-out", "{"), ("--run", '{"rate": 1}'), ("--backend", "arm")])
def test_an_option_that_is_not_valid_is_wrong_usage(
    option: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["campaign", str(example_robot("paper_arm")), "--out", str(tmp_path / "out"), option, text]
    assert main(words) == 2
    assert not (tmp_path / "out").exists()
