"""Simulated recordings: the torque's parts, the noise, the encoder, the file."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tauscope.errors import RecordingError
from tauscope.robot.robot import FrictionCoefficients, Robot
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import SimulatedRecording, rigid_body_torque, simulate_recording, write_recording_csv


def record(robot: Robot, seed: int = 1, **settings: Any) -> SimulatedRecording:
    motion = random_fourier_motion(robot.joints, np.random.default_rng(7))
    defaults: dict[str, Any] = {"rate_hz": 50.0, "periods": 2, "noise_std": [0.5, 0.3, 0.7]}
    return simulate_recording(robot, motion, rng=np.random.default_rng(seed), **(defaults | settings))


def test_exact_torque_is_rigid_body_plus_friction(paper: Robot) -> None:
    recording = record(paper)
    exact = recording.exact
    assert paper.model.friction is not None
    friction = static_friction_torque(exact.velocity, paper.model.friction, [j.friction_shape for j in paper.joints])
    rigid = rigid_body_torque(build_model(paper), exact.position, exact.velocity, exact.acceleration)
    np.testing.assert_allclose(recording.torque_exact, rigid + friction, atol=1e-12)
    assert np.abs(friction).max() > 1.0


def test_friction_is_that_of_the_robot(paper: Robot) -> None:
    plain, viscous = (
        record(replace(paper, model=replace(paper.model, friction=(FrictionCoefficients(viscous=viscous),) * 3)))
        for viscous in (0.0, 1.0)
    )
    np.testing.assert_allclose(viscous.torque_exact - plain.torque_exact, plain.exact.velocity, atol=1e-12)
    unstated = replace(paper, model=replace(paper.model, friction=None))
    np.testing.assert_array_equal(record(unstated).torque_exact, plain.torque_exact)


def test_time_is_uniform_and_periods_repeat(paper: Robot) -> None:
    recording = record(paper, periods=3)
    np.testing.assert_allclose(np.diff(recording.time), 0.02, rtol=1e-9)
    np.testing.assert_array_equal(recording.period, np.repeat([0, 1, 2], 500))
    torque = recording.torque_exact.reshape(3, 500, 3)
    np.testing.assert_array_equal(torque[0], torque[2])


def test_noise_has_the_stated_deviation_and_is_independent(paper: Robot) -> None:
    recording = record(paper, rate_hz=1000.0)
    noise = recording.torque - recording.torque_exact
    count = len(noise)
    # five standard errors of a mean, a standard deviation and a correlation
    assert np.all(np.abs(noise.mean(axis=0)) < 5 * np.array([0.5, 0.3, 0.7]) / np.sqrt(count))
    np.testing.assert_allclose(noise.std(axis=0), [0.5, 0.3, 0.7], rtol=5 / np.sqrt(2 * count))
    correlation = np.corrcoef(np.vstack([noise.T, [*noise[1:, 0].tolist(), 0.0]]))
    assert np.abs(correlation - np.eye(4)).max() < 5 / np.sqrt(count)


def test_position_is_exact_unless_asked_otherwise(paper: Robot) -> None:
    recording = record(paper)
    np.testing.assert_array_equal(recording.position, recording.exact.position)
    noisy = record(paper, position_noise_std=1e-3)
    assert (noisy.position - noisy.exact.position).std() == pytest.approx(1e-3, rel=0.1)


def test_encoder_rounds_to_its_step(paper: Robot) -> None:
    step = 2 * np.pi / 4096
    recording = record(paper, encoder_step=[step, 0.0, step])
    turns = recording.position[:, [0, 2]] / step
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-9)
    error = np.abs(recording.position - recording.exact.position)
    assert 0.4 * step < error[:, [0, 2]].max() <= 0.5 * step + 1e-12
    assert error[:, 1].max() == 0.0


def test_a_seed_reproduces_the_recording(paper: Robot) -> None:
    first, again, other = record(paper, 1), record(paper, 1), record(paper, 2)
    np.testing.assert_array_equal(first.torque, again.torque)
    assert not np.any(first.torque == other.torque)
    np.testing.assert_array_equal(first.torque_exact, other.torque_exact)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"rate_hz": 33.33}, "rate_hz 33.33 puts 333.3 samples"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": 0.01}, "rate_hz"),
        ({"periods": 0}, "periods"),
        ({"noise_std": [0.1, 0.1]}, "noise_std has 2 values"),
        ({"noise_std": -0.1}, "noise_std"),
        ({"position_noise_std": np.nan}, "position_noise_std"),
        ({"encoder_step": -1.0}, "encoder_step"),
    ],
)
def test_impossible_settings_are_named(paper: Robot, settings: dict[str, Any], named: str) -> None:
    with pytest.raises(RecordingError, match=named):
        record(paper, **settings)


def test_a_motion_of_another_arm_is_refused(paper: Robot) -> None:
    motion = random_fourier_motion(paper.joints[:2], np.random.default_rng(7))
    with pytest.raises(RecordingError, match="moves 2 joints; the arm has 3"):
        simulate_recording(paper, motion, rate_hz=50.0, periods=1, noise_std=0.0, rng=np.random.default_rng(0))


def test_csv_reads_back_exactly(paper: Robot, tmp_path: Path) -> None:
    recording, path = record(paper), tmp_path / "recording.csv"
    write_recording_csv(path, recording, paper.joints)
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["t", "q1", "q2", "q3", "tau1", "tau2", "tau3", "period"]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 0], recording.time)
    np.testing.assert_array_equal(table[:, 1:4], recording.position)
    np.testing.assert_array_equal(table[:, 4:7], recording.torque)
    np.testing.assert_array_equal(table[:, 7], recording.period)
    assert {row[7] for row in rows} == {"0", "1"}


def test_csv_holds_what_the_wiring_would_have_recorded(paper: Robot, tmp_path: Path) -> None:
    recording, path = record(paper), tmp_path / "currents.csv"
    joints = (replace(paper.joints[0], sign=-1), replace(paper.joints[1], torque_constant=0.5), paper.joints[2])
    write_recording_csv(path, recording, joints, as_current=True)
    assert path.read_text().startswith("t,q1,q2,q3,i1,i2,i3,period\n")
    current = np.loadtxt(path, delimiter=",", skiprows=1)[:, 4:7]
    np.testing.assert_allclose(current * [-1.0, 0.5, 1.0], recording.torque, rtol=1e-15)


def test_an_existing_file_is_never_overwritten(paper: Robot, tmp_path: Path) -> None:
    path = tmp_path / "real.csv"
    path.write_text("t,q1\n")
    with pytest.raises(RecordingError, match=r"real\.csv: exists already"):
        write_recording_csv(path, record(paper), paper.joints)
    assert path.read_text() == "t,q1\n"
    with pytest.raises(RecordingError, match=r"new\.csv: cannot be written \(No such file"):
        write_recording_csv(tmp_path / "nowhere" / "new.csv", record(paper), paper.joints)
