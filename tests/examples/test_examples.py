"""The scripts of docs/examples run as they are, and find what they say."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import runpy
import subprocess
import sys
from typing import Any

import pytest
from mujoco import MjSpec

from shared_data import REPOSITORY

pytestmark = pytest.mark.slow

EXAMPLES = REPOSITORY / "docs" / "examples"


def run(name: str) -> dict[str, Any]:
    """What a script has defined when it ends."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_every_example_is_run_here() -> None:
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    assert names == {"identify_from_csv", "compare_with_simulation", "campaign", "test_arm", "close_the_loop"}


def test_a_csv_and_a_urdf_give_a_model() -> None:
    made = run("identify_from_csv")
    assert made["result"].document.fit.held_out.relative_error < 0.05
    assert {path.name for path in made["folder"].iterdir()} >= {"model.json", "torque.png"}


def test_the_spring_that_the_simulation_lacks_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert [finding.effect for finding in run("compare_with_simulation")["result"].document.findings] == [
        "joint_spring"
    ]
    assert "spring is missing at elbow" in capsys.readouterr().out


def test_positions_and_commands_bring_the_simulated_arm_to_the_real_one(capsys: pytest.CaptureFixture[str]) -> None:
    made = run("close_the_loop")
    for after in (made["after"], made["pasted"]):
        assert (made["before"] > 3.0 * after).all()
    assert MjSpec.from_file(str(made["patched"])).joint("shoulder_pan").frictionloss == pytest.approx(0.2, abs=0.05)
    assert "the mean error falls" in capsys.readouterr().out


@pytest.mark.proof
def test_the_campaign_decides_what_was_open() -> None:
    findings = run("campaign")["diagnosis"].document.findings
    assert [(finding.effect, finding.joint) for finding in findings] == [("joint_spring", "shoulder")]


def test_the_checks_of_an_arm_pass() -> None:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-c",
        "/dev/null",
        f"--rootdir={EXAMPLES}",
    ]
    done = subprocess.run([*command, str(EXAMPLES / "test_arm.py")], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 passed" in done.stdout
