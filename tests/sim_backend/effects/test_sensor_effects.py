"""What the sensors make of a sample: gain, saturation, delay, noise and steps; and that they leave the motion alone."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.effects.sensor_effects import TimeDelay, TorqueGainError, TorqueSaturation
from tauscope_sim.scenario import Scenario, Sensors

Array = NDArray[np.float64]


@pytest.fixture
def samples() -> tuple[Array, Array, Array]:
    """Time, position and torque of three joints at 500 Hz: smooth, so that between samples they are nearly linear."""
    time = np.arange(500) / 500.0
    position = np.sin(np.multiply.outer(time, [2.0, 3.0, 5.0]))
    torque = 20.0 * np.cos(np.multiply.outer(time, [4.0, 3.0, 6.0]))
    return time, position, torque


def measure_all(sensors: Sensors, time: Array, position: Array, torque: Array) -> tuple[Array, Array]:
    """Position and torque as recorded of a whole motion."""
    rows = [sensors.measure(float(t), q, u) for t, q, u in zip(time, position, torque, strict=True)]
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


def recorded(
    robot: Robot, effects: list[Any], samples: tuple[Array, Array, Array], **levels: Any
) -> tuple[Array, Array]:
    scenario = Scenario(sensor_effects=tuple(effects), **levels)
    return measure_all(scenario.sensors(robot, np.random.default_rng(5)), *samples)


def test_nothing_concealed_records_the_truth(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    position, torque = recorded(paper, [], samples)
    np.testing.assert_array_equal(position, samples[1])
    np.testing.assert_array_equal(torque, samples[2])


def test_gain_scales_one_joint(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    position, torque = recorded(paper, [TorqueGainError(joint=2, gain=-1.05)], samples)
    np.testing.assert_array_equal(torque, samples[2] * [1.0, -1.05, 1.0])
    np.testing.assert_array_equal(position, samples[1])


def test_compression_takes_off_a_cubic_part(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    torque = recorded(paper, [TorqueSaturation(joint=1, level=200.0)], samples)[1]
    true = samples[2][:, 0]
    np.testing.assert_allclose(torque[:, 0] - true, -(true**3) / (3 * 200.0**2), rtol=0, atol=5e-4)
    np.testing.assert_array_equal(torque[:, 1:], samples[2][:, 1:])


def test_clipping_cuts_at_the_level(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    torque = recorded(paper, [TorqueSaturation(joint=3, level=12.0, shape="clip")], samples)[1]
    np.testing.assert_allclose(torque[:, 2], np.clip(samples[2][:, 2], -12.0, 12.0), rtol=1e-15)
    assert np.any(torque[:, 2] == 12.0)


@pytest.mark.parametrize("delay", [0.0007, 0.002, 0.0051, 0.02])
def test_torque_comes_late(delay: float, paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    position, torque = recorded(paper, [TimeDelay(delay=delay)], samples)
    np.testing.assert_array_equal(position, samples[1])
    time = samples[0] - delay
    exact = 20.0 * np.cos(np.multiply.outer(time, [4.0, 3.0, 6.0]))
    known = time >= 0.0
    # linear between samples 2 ms apart: at most (2 ms)²/8 times the second derivative
    np.testing.assert_allclose(torque[known], exact[known], rtol=0, atol=20.0 * 36.0 * 0.002**2 / 8)
    np.testing.assert_array_equal(torque[~known], np.broadcast_to(samples[2][0], torque[~known].shape))


def test_a_negative_delay_makes_one_position_late(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    position, torque = recorded(paper, [TimeDelay(delay=-0.004, joint=2)], samples)
    np.testing.assert_array_equal(torque, samples[2])
    np.testing.assert_allclose(position[2:, 1], samples[1][:-2, 1], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(position[:, [0, 2]], samples[1][:, [0, 2]])


def test_a_delay_line_works_at_any_rate(paper: Robot, rng: np.random.Generator) -> None:
    """Irregular instants: interpolation of what was seen, as NumPy has it."""
    time = np.cumsum(rng.uniform(1e-4, 5e-3, 300))
    torque = rng.normal(size=(300, 3))
    late = recorded(paper, [TimeDelay(delay=0.0123)], (time, np.zeros((300, 3)), torque))[1]
    expected = np.column_stack([np.interp(time - 0.0123, time, torque[:, joint]) for joint in range(3)])
    np.testing.assert_allclose(late, expected, rtol=0, atol=1e-9)


def test_effects_follow_one_another(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    effects = [TorqueGainError(joint=1, gain=2.0), TorqueSaturation(joint=1, level=10.0, shape="clip")]
    forth = recorded(paper, effects, samples)[1][:, 0]
    back = recorded(paper, effects[::-1], samples)[1][:, 0]
    assert np.max(forth) == 10.0
    assert np.max(back) == 20.0


def test_noise_and_steps(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    position, torque = recorded(
        paper,
        [],
        samples,
        torque_noise_std=np.array([0.5, 0.3, 0.7]),
        position_noise_std=np.array([1e-4, 2e-4, 0.0]),
        encoder_step=np.array([0.0, 0.0, 1e-3]),
    )
    np.testing.assert_allclose(np.std(torque - samples[2], axis=0), [0.5, 0.3, 0.7], rtol=0.12)
    np.testing.assert_allclose(np.std(position - samples[1], axis=0)[:2], [1e-4, 2e-4], rtol=0.12)
    np.testing.assert_allclose(position[:, 2], np.round(samples[1][:, 2] / 1e-3) * 1e-3, rtol=0, atol=1e-15)


def test_the_seed_decides_the_noise(paper: Robot, samples: tuple[Array, Array, Array]) -> None:
    def noise(seed: int) -> Array:
        return measure_all(Scenario(torque_noise_std=np.array(0.5), seed=seed).sensors(paper), *samples)[1]

    np.testing.assert_array_equal(noise(3), noise(3))
    assert not np.array_equal(noise(3), noise(4))
