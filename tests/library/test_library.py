"""What ``import tauscope`` offers, held against CONTRACT.md."""

import subprocess
import sys
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
from matplotlib.figure import Figure

import tauscope
from cli.simulated_files import SimulatedFiles, write_files
from diagnosis.diagnosed_arm import only_effects
from excitation.excited_arms import short_search
from tauscope.errors import MissingExtraError, RecordingMismatchError
from tauscope.library import RecordingSource
from tauscope.results import DiagnosisResult, ExcitationResult, IdentificationResult, SimulationResult

NAMES = ["design_excitation", "diagnose", "identify", "load_robot", "read_recording", "rollout", "simulate"]
RATE_HZ = 100.0
SPRING = {"torque_noise_std": [0.05, 0.03, 0.07], "effects": [{"effect": "joint_spring", "joint": 1, "stiffness": 2.0}]}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> SimulatedFiles:
    return write_files(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def identification(files: SimulatedFiles) -> IdentificationResult:
    robot = tauscope.load_robot(files.robot)
    sources: list[RecordingSource] = [files.train[0], tauscope.read_recording(files.train[1], robot)]
    return tauscope.identify(robot, sources, held_out=files.held_out[0])


@pytest.fixture(scope="module")
def motion() -> ExcitationResult:
    from tauscope_sim.examples import example_robot

    options = {"slow_reversals": False, "closing_period": False}
    with short_search():
        return tauscope.design_excitation(example_robot("paper_arm"), period_s=5.0, harmonics=3, periods=2, **options)


@pytest.fixture(scope="module")
def simulation(motion: ExcitationResult) -> SimulationResult:
    from tauscope_sim.examples import example_robot

    return tauscope.simulate(example_robot("paper_arm"), motion, scenario=SPRING, rate_hz=RATE_HZ, name="spring")


def test_the_names_are_those_of_the_contract() -> None:
    assert sorted(tauscope.__all__) == dir(tauscope) == NAMES
    assert all(getattr(tauscope, name).__doc__ for name in NAMES)
    with pytest.raises(AttributeError, match="no attribute 'identfy'"):
        getattr(tauscope, "identfy")  # noqa: B009


def test_importing_it_loads_nothing_else() -> None:
    code = "import sys, tauscope; print([m for m in sys.modules if m.startswith(('tauscope.', 'numpy'))])"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout == "[]\n"


def test_results_are_typed() -> None:
    for kind in (IdentificationResult, DiagnosisResult, ExcitationResult, SimulationResult):
        assert get_type_hints(kind.to_dict)["return"] == dict[str, Any]
        assert all(getattr(kind, name).__doc__ for name in ("to_dict", "to_frame", "plot"))


def test_an_identification_is_the_commands(identification: IdentificationResult) -> None:
    written = identification.to_dict()
    assert written["schema"] == "tauscope.identification/1"
    assert written["fit"]["held_out"]["relative_error"] < 0.05
    frame = identification.to_frame()
    assert list(frame.columns) == ["parameter", "value", "std"]
    base = written["base_parameters"]
    np.testing.assert_array_equal(frame["value"][: len(base)], [entry["value"] for entry in base])
    figure = identification.plot()
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 3


def test_a_simulation_is_a_recording(motion: ExcitationResult, simulation: SimulationResult) -> None:
    assert simulation.recording.name == "spring"
    frame = simulation.to_frame()
    assert list(frame.columns[:7]) == ["t", "q1", "q2", "q3", "tau1", "tau2", "tau3"]
    assert simulation.to_dict()["q2"] == frame["q2"].tolist()
    assert len(simulation.plot().axes) == 3
    assert frame["t"].iloc[-1] == pytest.approx(motion.design.trajectory.duration_s, abs=0.02)


def test_a_motion_is_the_designs(motion: ExcitationResult) -> None:
    assert motion.to_dict()["joints"] == ["joint1", "joint2", "joint3"]
    frame = motion.to_frame()
    assert list(frame.columns) == ["t", *(f"{group}{joint}" for group in ("q", "qd", "qdd") for joint in (1, 2, 3))]
    np.testing.assert_allclose(np.gradient(frame["q1"], frame["t"])[5:-5], frame["qd1"][5:-5], atol=0.02)
    assert len(motion.plot().axes) == 3


def test_a_diagnosis_names_the_spring(simulation: SimulationResult) -> None:
    from tauscope_sim.examples import example_robot

    with only_effects(["joint_spring"]):
        result = tauscope.diagnose(example_robot("paper_arm"), simulation, against="model")
    assert result.to_dict()["schema"] == "tauscope.diagnosis/1"
    assert result.document.against == "model"
    assert list(result.to_frame().columns) == [
        "effect", "joint", "probability", "parameter", "value", "std", "unit",
    ]  # fmt: skip
    assert "joint_spring" in set(result.to_frame()["effect"])
    assert len(result.plot().axes) == 3


def test_a_recording_of_another_arm_is_refused(files: SimulatedFiles, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("t,q1,tau1\n0,0,0\n0.01,0,0\n", encoding="utf-8")
    with pytest.raises(RecordingMismatchError):
        tauscope.read_recording(other, files.robot)


def test_pandas_is_asked_for_in_one_line(identification: IdentificationResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"^to_frame needs the pandas extra: pip install 'tauscope\[pandas\]'$"):
        identification.to_frame()


def test_rollout(simulation: SimulationResult) -> None:
    """Torque of the spring's arm drives one without it: the rollout sees the difference."""
    from tauscope_sim.examples import example_robot

    result = tauscope.rollout(example_robot("paper_arm"), simulation)
    assert result.to_dict()["schema"] == "tauscope.rollout/1"
    assert result.document.drive == "torque"
    assert [entry.model for entry in result.document.summary] == ["stated"]
    assert list(result.to_frame().columns) == ["recording", "model", "joint", "rms", "worst", "lag"]
    assert len(result.plot().axes) == 3
