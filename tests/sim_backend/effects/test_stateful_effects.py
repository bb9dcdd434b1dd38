"""Effects with states of their own: bristles, and the joint's temperature."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope_sim.effects.friction_drift import FrictionDrift
from tauscope_sim.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope_sim.plant import Plant

Array = NDArray[np.float64]


def smooth_sign(v: Any, k_v: float = 500.0) -> Any:
    return np.arctan(k_v * v) / (np.pi / 2)


def bristle_rates(
    pendulum: Any, distance: float, lugre: bool, damping: float
) -> Callable[[float, Array, Array], Array]:
    """I q̈ = u - gravity - bristles - what stays of the static friction."""

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v, z = y
        level = 1.0 + pendulum.stribeck / pendulum.stiction * smooth_sign(abs(v), 10.0) if lugre else 1.0
        z_rate = (v - abs(v) * z / level) / distance
        friction = pendulum.stiction * z + pendulum.viscous * v + damping * distance * z_rate
        if not lugre:
            friction += pendulum.stribeck * smooth_sign(v, 10.0)
        return np.array([v, (u[0] - pendulum.gravity(q) - friction) / pendulum.inertia, z_rate])

    return rates


@pytest.mark.parametrize(("lugre", "damping"), [(False, 0.0), (True, 0.0), (True, 3.0)])
def test_bristles_replace_the_coulomb_friction(lugre: bool, damping: float, pendulum: Any, pendulum_trial: Any) -> None:
    effect = PreslidingHysteresis(joint=1, distance=0.012, bristles="lugre" if lugre else "dahl", damping=damping)
    expected = pendulum_trial.integrate(bristle_rates(pendulum, 0.012, lugre, damping), [0.3, 0.0, 0.0])
    simulated = pendulum_trial.simulate(pendulum.robot, [effect])
    np.testing.assert_allclose(simulated["motor_position"][:, 0], expected[:, 0], rtol=0, atol=1e-4)
    plain = pendulum_trial.simulate(pendulum.robot)
    assert np.max(np.abs(simulated["motor_position"] - plain["motor_position"])) > 5e-3


def test_steady_sliding_takes_the_static_friction(pendulum: Any) -> None:
    """A weightless pendulum that is pulled evenly ends at the speed at which static friction equals the pull."""
    weightless = pendulum.__class__(moment=1e-9, viscous=2.0)
    plain, bristly = (
        Plant(weightless.robot),
        Plant(weightless.robot, [PreslidingHysteresis(joint=1, distance=0.01, bristles="lugre")]),
    )
    for plant in (plain, bristly):
        plant.place([0.0])
        plant.advance([1.1], 3.0)
    speed = bristly.state.motor_velocity[0]
    # the bristles are bent to the full where the arctangent is still 0.6 % short of one
    bent = weightless.stiction + weightless.stribeck * smooth_sign(speed, 10.0) + weightless.viscous * speed
    assert bent == pytest.approx(1.1, rel=1e-5)
    assert weightless.friction(plain.state.motor_velocity[0]) == pytest.approx(1.1, rel=1e-5)
    assert speed == pytest.approx(plain.state.motor_velocity[0], rel=0.02)


def test_a_push_below_stiction_is_sprung_and_hysteretic(pendulum: Any) -> None:
    """Dahl's curve: to u τ_s on the way up the bristles give x = -x_s ln(1 - u)."""
    weightless = pendulum.__class__(moment=1e-9, viscous=6.0, stribeck=0.0)
    plant = Plant(weightless.robot, [PreslidingHysteresis(joint=1, distance=0.01)])
    plant.place([0.0])
    for push in np.linspace(0.0, 0.6, 61):
        plant.advance([push * weightless.stiction], 0.02)
    plant.advance([0.6 * weightless.stiction], 1.5)
    assert plant.state.motor_position[0] == pytest.approx(-0.01 * np.log(1.0 - 0.6), rel=0.02)
    plant.advance([0.0], 1.0)
    assert plant.state.motor_position[0] > 1e-3


def test_friction_drifts_with_the_heat_that_it_makes(pendulum: Any, pendulum_trial: Any) -> None:
    keys = {"thermal_resistance": 40.0, "time_constant": 0.5, "coulomb_per_kelvin": -0.02, "viscous_per_kelvin": -0.03}
    effect = FrictionDrift(joint=1, initial_temperature=30.0, **keys)

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v, rise = y
        coulomb = pendulum.stiction * smooth_sign(v) + pendulum.stribeck * smooth_sign(v, 10.0)
        friction = np.exp(-0.02 * rise) * coulomb + np.exp(-0.03 * rise) * pendulum.viscous * v
        acceleration = (u[0] - pendulum.gravity(q) - friction) / pendulum.inertia
        return np.array([v, acceleration, (40.0 * friction * v - rise) / 0.5])

    expected = pendulum_trial.integrate(rates, [0.3, 0.0, 5.0])
    simulated = pendulum_trial.simulate(pendulum.robot, [effect])
    np.testing.assert_allclose(simulated["motor_position"][:, 0], expected[:, 0], rtol=0, atol=1e-4)
    np.testing.assert_allclose(simulated["temperature"][:, 0], 25.0 + expected[:, 2], rtol=0, atol=2e-3)
    assert np.ptp(simulated["temperature"]) > 10.0
    plain = pendulum_trial.simulate(pendulum.robot)
    assert np.max(np.abs(simulated["motor_position"] - plain["motor_position"])) > 5e-3


def test_a_resting_joint_cools_to_the_ambient(pendulum: Any) -> None:
    plant = Plant(
        pendulum.robot, [FrictionDrift(joint=1, initial_temperature=60.0, thermal_resistance=1.0, time_constant=2.0)]
    )
    plant.place([-np.pi / 2])
    assert plant.state.temperature[0] == 60.0
    plant.advance([0.0], 2.0)
    assert plant.state.temperature[0] == pytest.approx(25.0 + 35.0 * np.exp(-1.0), abs=1e-4)
