"""Runs of the simulated arm: the registry, virtual time, and both ways of control."""

from pathlib import Path

import numpy as np
import pytest

import tauscope_drivers
from tauscope.dynamics import friction_torque, inverse_dynamics
from tauscope.errors import AcquisitionError, ScenarioError
from tauscope.recording import read_recording
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import DEFAULT_BACKEND, driver_names, find_driver, make_backend
from tauscope.runtime.options import RunOptions
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope.trajectory import FourierSegment, FourierSeries, Trajectory
from tauscope_sim.examples import example_robot

SCENARIO = "torque_noise_std: [0.5, 0.3, 0.7]\nseed: 5\n"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return read_robot(example_robot("paper_arm"))


def motion(robot: Robot, period_s: float = 2.0, repeats: int = 1) -> Trajectory:
    """Three harmonics, at rest with zero acceleration at both ends of a period."""
    rng = np.random.default_rng(4)
    order = np.arange(1, 4)
    cosine, sine = rng.normal(size=(2, 3, 3)) * 0.25
    cosine -= cosine.mean(axis=1, keepdims=True)
    sine -= (sine @ order)[:, None] * order / (order @ order)
    series = FourierSeries(period_s, np.array([0.1, -0.2, 0.3]), cosine, sine)
    return Trajectory(robot.name, tuple(joint.name for joint in robot.joints), (FourierSegment(series, repeats, 0),))


@pytest.mark.parametrize("mode", ["position", "torque"])
def test_the_recorded_torque_is_the_arms(tmp_path: Path, robot: Robot, mode: str) -> None:
    """Against the model's own inverse dynamics along the motion, away from reversals, where friction jumps."""
    played = motion(robot)
    record = run_trajectory(
        robot,
        played,
        lambda: make_backend("sim", robot, {"start": [0.4, -0.3, 0.2]}),
        tmp_path / "run",
        RunOptions.model_validate({"mode": mode, "rate_hz": 250}),
    )
    assert record.state is RunState.FINISHED, record.problem
    assert max(record.worst_following) < 0.05
    samples = read_recording(tmp_path / "run" / "recording.csv").samples()
    assert len(samples.time) == 501
    np.testing.assert_allclose(np.diff(samples.time), 0.004, atol=1e-9)
    # Where the arm was, by its own reading: position tracking may lag by a cycle or two.
    at = played.evaluate(samples.time)
    lag = min(range(6), key=lambda k: np.abs(samples.position[k:] - at.position[: len(at.position) - k]).max())
    rows = slice(20, 480)
    position, velocity, acceleration = (part[rows] for part in (at.position, at.velocity, at.acceleration))
    parameters = np.concatenate([link.to_vector() for link in robot.model.links or ()])
    expected = inverse_dynamics(robot, parameters, position, velocity, acceleration)
    for j, coefficients in enumerate(robot.model.friction or ()):
        shape = robot.joints[j].friction_shape
        expected[:, j] += friction_torque(coefficients, shape, np.ascontiguousarray(velocity[:, j]))
    measured = samples.effort[20 + lag : 480 + lag]
    calm = (np.abs(velocity) > 0.1).all(axis=1)
    error = np.sqrt(((measured - expected)[calm] ** 2).mean(axis=0))
    assert (error < 0.1 * np.abs(expected).max(axis=0)).all(), error


def test_a_scenario_is_carried_out(tmp_path: Path, robot: Robot) -> None:
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    efforts = []
    for name, concealed in (("noisy", {"scenario": str(scenario)}), ("calm", {})):
        settings = {"start": motion(robot).start.tolist(), **concealed}
        run_trajectory(
            robot,
            motion(robot),
            lambda settings=settings: make_backend("sim", robot, settings),
            tmp_path / name,
            RunOptions(rate_hz=200.0),
        )
        efforts.append(read_recording(tmp_path / name / "recording.csv").samples().effort)
    noise = (efforts[0] - efforts[1]).std(axis=0)
    np.testing.assert_allclose(noise, [0.5, 0.3, 0.7], rtol=0.15)


@pytest.mark.parametrize(
    ("name", "settings", "words"),
    [
        ("dynamixel", {}, "joint1 has no drive block"),
        ("canopen", {}, "joint1 has no drive block"),
        ("simu", {}, "there is no backend 'simu'; did you mean 'sim'?"),
        ("sim", {"tmie": "real"}, "unknown setting 'tmie'; did you mean 'time'"),
        ("sim", {"time": "fast"}, "time is 'fast'; choose virtual or real"),
        ("sim", {"start": [0.0]}, "start has to be 3 numbers"),
        ("sim", {"start": [0.0, float("nan"), 0.0]}, "start has to be finite numbers"),
        ("sim", {"start": ["a", "b", "c"]}, "start has to be finite numbers"),
        ("sim", {"scenario": 5}, "scenario is 5; give the path"),
        ("sim", {"socket": "x.sock"}, "a socket belongs to an arm in real time"),
        ("sim", {"time": "real", "socket": "x.sock", "start": [0, 0, 0]}, "leave out socket"),
    ],
)
def test_backends_that_cannot_be_made(robot: Robot, name: str, settings: dict, words: str) -> None:
    with pytest.raises(AcquisitionError) as raised:
        make_backend(name, robot, settings)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_missing_scenario_is_named(robot: Robot, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"none\.yaml"):
        make_backend("sim", robot, {"scenario": str(tmp_path / "none.yaml")})


def test_every_backend_has_a_name() -> None:
    folders = Path(tauscope_drivers.__file__).parent.glob("*/driver.py")
    first, *others = driver_names()
    assert first == DEFAULT_BACKEND
    assert others == sorted(folder.parent.name for folder in folders)
    assert all(find_driver(name).name == name for name in others)
