"""A transmission that gives way, worked out along the motion of its motor: the same as a simulation."""

from typing import Any

import numpy as np
import pytest
from scipy import signal

from concealed.generator.arms import NOISE_STD, arm_named
from concealed.generator.forward import _played, physical
from concealed.generator.motions import Motion
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.transmissions import LinkEquation, follow, transmission_torque
from tauscope_sim.effects.elastic_transmissions import JointElasticity
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import rigid_body_torque

pytestmark = pytest.mark.slow

SOFT = {"effect": "joint_elasticity", "joint": 2, "stiffness": 500.0, "damping": 1.0, "rotor_inertia": 0.004}
STIFF = {**SOFT, "stiffness": 2e4, "damping": 40.0}
TEETH = {"effect": "backlash", "joint": 2, "gap": 0.02, "contact_stiffness": 1e4, "rotor_inertia": 0.004}


@pytest.mark.parametrize("entry", [SOFT, STIFF, TEETH])
def test_the_drives_of_a_simulated_arm_need_the_same(entry: dict[str, Any]) -> None:
    robot = arm_named("paper")
    series = random_fourier_motion(robot.joints, np.random.default_rng(4), period_s=2.5, limit_fraction=0.5)
    effects = physical([entry])
    made = _played(robot, effects, Motion("short", series, 1).setpoints)
    rigid = rigid_body_torque(
        build_model(robot), made.position, made.velocity, np.gradient(made.velocity, 1e-3, axis=0)
    )
    shapes = [joint.friction_shape for joint in robot.joints]
    simulated = made.torque - rigid - static_friction_torque(made.velocity, robot.model.friction or (), shapes)
    found = transmission_torque(robot, effects[0], made.position, made.velocity)  # type: ignore[arg-type]
    inside = slice(300, -300)
    error, size = (band(each)[inside].std(axis=0) / NOISE_STD["paper"] for each in (simulated - found, found))
    assert error[1] < max(0.05 * size[1], 0.02)
    assert max(error[0], error[2]) < 0.03


def band(torque: np.ndarray) -> np.ndarray:
    return np.asarray(signal.sosfiltfilt(signal.butter(4, 20.0, fs=FINE * RATE_HZ, output="sos"), torque, axis=0))


def test_a_link_swings_and_settles_as_the_equation_of_one_mass_says() -> None:
    """m ẍ + D ẋ + K x = -τ with a step of τ: a damped oscillation in closed form."""
    count, m, k, d, step = 2000, 0.2, 800.0, 2.0, 3.0
    ones = np.ones(count)
    equation = LinkEquation(m * ones, 0.0 * ones, 0.0 * ones, step * ones, 0.0)
    lead, rate = follow(equation, JointElasticity(joint=1, stiffness=k, damping=d, rotor_inertia=0.01))
    time = 1e-3 * np.arange(count)
    sigma, omega = 0.5 * d / m, np.sqrt(k / m - (0.5 * d / m) ** 2)
    shape = np.exp(-sigma * time) * (np.cos(omega * time) + sigma / omega * np.sin(omega * time))
    np.testing.assert_allclose(lead, -step / k * (1.0 - shape), atol=0.01 * step / k)
    assert rate[0] == 0.0
