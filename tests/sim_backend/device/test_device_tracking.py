"""The simulated drives follow a motion closely, and what they report obeys the equations of motion."""

from typing import Any

import numpy as np
import pytest

from arm_rigs import bench_robot, wide_limits
from tauscope.robot.robot import Robot
from tauscope_drivers import ControlMode, Setpoint, StopPolicy
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import rigid_body_torque
from tauscope_sim.scenario import Scenario

RATE_HZ = 500.0


def played(robot: Robot, *, scenario: Scenario | None = None, duration_s: float = 3.0, rate_hz: float = RATE_HZ):
    """Play a random Fourier motion; returns the motion and the states."""
    motion = random_fourier_motion(robot.joints, np.random.default_rng(1), period_s=duration_s, harmonics=3)
    time = np.arange(round(duration_s * rate_hz)) / rate_hz
    asked = motion.evaluate(time).position
    arm = SimulatedArm(robot, scenario, start_position=asked[0])
    arm.connect()
    arm.enable(ControlMode.POSITION, wide_limits(robot, torque=1e3), StopPolicy.HOLD, 0.1)
    zero = np.zeros(robot.joint_count)
    states = []
    for t, position in zip(time, asked, strict=True):
        arm.clock.wait_until_ns(round(t * 1e9))
        states.append(arm.exchange(Setpoint(position, zero)))
    return motion, states


@pytest.fixture(scope="module")
def runs() -> dict[str, Any]:
    """Runs that several tests look at, by arm."""
    return {}


@pytest.fixture
def run(runs: dict[str, Any], arm_name: str, robot: Robot):
    if arm_name not in runs:
        runs[arm_name] = played(robot)
    return runs[arm_name]


def test_a_fourier_motion_is_tracked_within_a_few_milliradians(run) -> None:
    motion, states = run
    time = np.array([state.time_ns for state in states]) * 1e-9
    position = np.array([state.position for state in states])
    # the drives' interpolation is two cycles late, and a setpoint counts from the next tick on
    error = position - motion.evaluate(time - 2.0 / RATE_HZ).position
    settled = time > 0.3
    assert np.sqrt(np.mean(error[settled] ** 2, axis=0)).max() < 1e-3
    assert np.abs(error[settled]).max() < 5e-3
    assert not states[-1].faults


def test_reported_torque_belongs_to_the_reported_instant(robot: Robot, run) -> None:
    # the judge is MuJoCo's inverse dynamics at positions differentiated by the test itself
    _, states = run
    q = np.array([state.position for state in states])
    effort = np.array([state.effort for state in states])[2:-2]
    h = 1.0 / RATE_HZ
    velocity = (8.0 * (q[3:-1] - q[1:-3]) - (q[4:] - q[:-4])) / (12.0 * h)
    acceleration = (16.0 * (q[3:-1] + q[1:-3]) - (q[4:] + q[:-4]) - 30.0 * q[2:-2]) / (12.0 * h**2)
    rigid = rigid_body_torque(build_model(robot), q[2:-2], velocity, acceleration)
    shapes = [joint.friction_shape for joint in robot.joints]
    assert robot.model.friction is not None
    expected = rigid + static_friction_torque(velocity, robot.model.friction, shapes)
    # near a reversal friction turns faster than these samples can follow
    turning = np.any(np.abs(velocity) < 0.05, axis=1).astype(float)
    steady = np.convolve(turning, np.ones(81), mode="same") == 0.0
    steady[: round(0.3 * RATE_HZ)] = False
    assert steady.sum() > 100
    residual = (effort - expected)[steady]
    assert np.sqrt(np.mean(residual**2, axis=0)).max() < 5e-4
    slope = np.gradient(expected, h, axis=0)[steady]
    delay = (residual * slope).sum(axis=0) / (slope**2).sum(axis=0)
    assert np.abs(delay).max() < 5e-6, "no channel is late"


def test_velocities_are_those_of_the_positions(run) -> None:
    _, states = run
    q = np.array([state.position for state in states])
    velocity = np.array([state.velocity for state in states])
    np.testing.assert_allclose(velocity[1:-1], 0.5 * RATE_HZ * (q[2:] - q[:-2]), atol=0.02)


@pytest.mark.slow
def test_noise_steps_and_seed_are_the_scenarios() -> None:
    robot = bench_robot()
    scenario = Scenario(
        torque_noise_std=np.array([0.5, 0.3, 0.7]), encoder_step=np.array(1e-3), command_latency_s=0.0, seed=4
    )
    _, clean = played(robot, duration_s=2.0)
    _, noisy = played(robot, scenario=scenario, duration_s=2.0)
    noise = np.array([b.effort - a.effort for a, b in zip(clean, noisy, strict=True)])
    np.testing.assert_allclose(noise.std(axis=0), scenario.torque_noise_std, rtol=0.1)
    assert np.abs(np.corrcoef(noise[:-1, 0], noise[1:, 0])[0, 1]) < 0.1
    steps = np.array([state.position for state in noisy]) / 1e-3
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_the_same_seed_gives_the_same_readings() -> None:
    scenario = Scenario(torque_noise_std=np.array(0.5), position_noise_std=np.array(1e-5), seed=4)
    first, second = (played(bench_robot(), scenario=scenario, duration_s=0.2)[1] for _ in range(2))
    for field in ("position", "velocity", "effort"):
        np.testing.assert_array_equal([getattr(s, field) for s in first], [getattr(s, field) for s in second])


def test_command_latency_delays_the_motion() -> None:
    robot = bench_robot()
    motion, states = played(robot, scenario=Scenario(command_latency_s=0.05), duration_s=2.0)
    time = np.array([state.time_ns for state in states]) * 1e-9
    late = motion.evaluate(time - 2.0 / RATE_HZ - 0.05).position
    error = np.array([state.position for state in states]) - late
    assert np.abs(error[time > 0.4]).max() < 5e-3


def test_the_upright_arm_whose_first_joint_has_no_inertia_is_held_and_driven() -> None:
    robot = bench_robot()
    arm = SimulatedArm(robot, start_position=np.zeros(3))
    arm.connect()
    arm.enable(ControlMode.POSITION, wide_limits(robot), StopPolicy.HOLD, 0.1)
    model, still, push = build_model(robot), np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]])
    inertia = rigid_body_torque(model, still, still, push) - rigid_body_torque(model, still, still, still)
    assert inertia[0, 0] < 1e-9, "the place is the awkward one"
    velocity = []
    for cycle in range(500):
        arm.clock.wait_until_ns(cycle * 2_000_000)
        t = cycle * 2e-3
        target = t**3 * (10.0 - 15.0 * t + 6.0 * t * t) * np.array([0.1, 0.2, 0.1])
        velocity.append(arm.exchange(Setpoint(target, np.zeros(3))).velocity)
    arm.clock.wait_until_ns(arm.clock.now_ns() + 50_000_000)
    np.testing.assert_allclose(arm.stop(StopPolicy.HOLD).position, [0.1, 0.2, 0.1], atol=0.02)
    assert np.abs(velocity).max() < 0.8, "it does not chatter"


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 333.0, 1000.0])
def test_any_rate_is_tracked(rate_hz: float) -> None:
    motion, states = played(bench_robot(), rate_hz=rate_hz)
    time = np.array([state.time_ns for state in states]) * 1e-9
    error = np.array([state.position for state in states]) - motion.evaluate(time - 2.0 / rate_hz).position
    assert np.abs(error[time > 0.4]).max() < 1e-2
