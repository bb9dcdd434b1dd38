"""Effects between motor and link: load-dependent friction, ripple, elasticity and backlash."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope_sim.effects.carried_bodies import RotorInertia
from tauscope_sim.effects.elastic_transmissions import Backlash, JointElasticity
from tauscope_sim.effects.friction_laws import LoadDependentFriction
from tauscope_sim.effects.periodic_torques import Cogging, JointSpring, TorqueRipple
from tauscope_sim.plant import Plant
from tauscope_sim.plant.term import loaded_accelerations

Array = NDArray[np.float64]
Agree = Callable[..., dict[str, Array]]
TOLERANCE = 1e-4


def smooth_sign(v: Any, k_v: float = 500.0) -> Any:
    return np.arctan(k_v * v) / (np.pi / 2)


def test_the_load_loop_is_solved_and_not_lagged(rng: np.random.Generator) -> None:
    """u = J q̈ + L (1 + g) + |L| f with L = (H - J) q̈ + h, for random positive definite H."""
    for _ in range(200):
        count = int(rng.integers(1, 8))
        factor = rng.normal(size=(count, count))
        links = factor @ factor.T + 0.01 * np.eye(count)
        rotors = np.diag(rng.uniform(0.0, 2.0, count))
        drive, weight = rng.normal(scale=5.0, size=(2, count))
        gain, friction = rng.uniform(-0.2, 0.2, count), rng.uniform(-0.7, 0.7, count)
        pair = np.array([links + rotors, links])
        acceleration, load, matrix = loaded_accelerations(pair, drive, weight, gain, friction, np.ones(count))
        np.testing.assert_allclose(load, links @ acceleration + weight, rtol=1e-8, atol=1e-8)
        balance = rotors @ acceleration + load * (1.0 + gain) + np.abs(load) * friction
        np.testing.assert_allclose(balance, drive, rtol=1e-7, atol=1e-7)
        assert np.linalg.det(matrix) > 0.0


def loaded_rates(arm: Any, mu: float, ripple: Callable[[float], float], rotor: float) -> Callable[..., Array]:
    """Joint 2 loses ripple(q) L + mu |L| A(v) of its load, and carries a rotor: the sign of L that proves itself."""

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v = y[:2], y[2:]
        mass, bias = arm.mass_matrix(q), arm.bias(q, v)
        for sign in (1.0, -1.0):
            felt = np.array([1.0, 1.0 + ripple(q[1]) + sign * mu * smooth_sign(v[1])])
            matrix = felt[:, None] * mass + np.diag([0.0, rotor])
            acceleration = np.linalg.solve(matrix, u - arm.friction(v) - felt * bias)
            if sign * (mass @ acceleration + bias)[1] >= 0.0:
                break
        return np.concatenate([v, acceleration])

    return rates


CASES: dict[str, tuple[list[Any], Callable[..., Any]]] = {
    "friction": ([LoadDependentFriction(joint=2, mu=0.15)], lambda arm: loaded_rates(arm, 0.15, lambda q: 0.0, 0.0)),
    "friction behind a rotor": (
        [LoadDependentFriction(joint=2, mu=0.15), RotorInertia(joint=2, inertia=0.1)],
        lambda arm: loaded_rates(arm, 0.15, lambda q: 0.0, 0.1),
    ),
    "ripple": (
        [TorqueRipple(joint=2, amplitude=[0.1], order=[6.0], phase=[0.2])],
        lambda arm: loaded_rates(arm, 0.0, lambda q: 0.1 * np.sin(6 * q + 0.2), 0.0),
    ),
    "friction and ripple": (
        [TorqueRipple(joint=2, amplitude=[0.1], order=[6.0]), LoadDependentFriction(joint=2, mu=0.1)],
        lambda arm: loaded_rates(arm, 0.1, lambda q: 0.1 * np.sin(6 * q), 0.0),
    ),
}


QUICK = "friction and ripple"
EVERY_CASE = [pytest.param(each, marks=() if each == QUICK else pytest.mark.slow) for each in CASES]


@pytest.mark.parametrize("name", EVERY_CASE)
def test_what_the_load_costs(name: str, planar: Any, planar_trial: Any, agrees: Agree) -> None:
    effects, rates = CASES[name]
    agrees(planar.robot, effects, planar_trial, rates(planar), 2 * TOLERANCE)


def test_a_spring_is_part_of_the_load(pendulum: Any, pendulum_trial: Any, agrees: Agree) -> None:
    """With L = I q̈ + m g l cos q + k q, one joint without a rotor has L (1 + μ A sgn L) = u - τ_f."""

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v = y
        driven = u[0] - pendulum.friction(v)
        load = driven / (1.0 + 0.2 * smooth_sign(v) * np.sign(driven))
        return np.array([v, (load - pendulum.gravity(q) - 3.0 * q) / pendulum.inertia])

    effects = [LoadDependentFriction(joint=1, mu=0.2), JointSpring(joint=1, stiffness=3.0)]
    agrees(pendulum.robot, effects, pendulum_trial, rates, TOLERANCE)


def two_mass(arm: Any, torque: Callable[[float, float], float], rotor: float, mu: float = 0.0) -> Callable[..., Array]:
    """Pendulum behind a transmission: y = [q, θ, q̇, θ̇]; all friction on the motor."""

    def rates(t: float, y: Array, u: Array) -> Array:
        q, theta, v, omega = y
        handed = torque(theta - q, omega - v)
        felt = u[0] - arm.friction(omega) - handed - mu * abs(handed) * smooth_sign(omega)
        return np.array([v, omega, (handed - arm.gravity(q)) / arm.inertia, felt / rotor])

    return rates


def teeth(twist: float, rate: float, gap: float, stiffness: float, damping: float) -> float:
    overlap = abs(twist) - gap / 2
    if overlap <= 0.0:
        return 0.0
    return float(np.sign(twist) * stiffness * overlap * max(0.0, 1.0 + damping * np.sign(twist) * rate))


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.0, 0.15])
def test_an_elastic_joint_is_two_masses(mu: float, pendulum: Any, pendulum_trial: Any) -> None:
    effects: list[Any] = [JointElasticity(joint=1, stiffness=800.0, damping=0.5, rotor_inertia=0.1)]
    if mu:
        effects.append(LoadDependentFriction(joint=1, mu=mu))
    simulated = pendulum_trial.simulate(pendulum.robot, effects)
    link = simulated_start(pendulum, effects, pendulum_trial)
    # at rest the spring carries the weight: K (θ - q) = m g l cos q
    assert 800.0 * (0.3 - link) == pytest.approx(pendulum.gravity(link), rel=1e-9)
    rates = two_mass(pendulum, lambda twist, rate: 800.0 * twist + 0.5 * rate, 0.1, mu)
    expected = pendulum_trial.integrate(rates, [link, 0.3, 0.0, 0.0])
    np.testing.assert_allclose(simulated["link_position"][:, 0], expected[:, 0], rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(simulated["motor_position"][:, 0], expected[:, 1], rtol=0, atol=TOLERANCE)
    assert np.max(np.abs(simulated["motor_position"] - simulated["link_position"])) > 5e-3


@pytest.mark.parametrize("beside", [0.0, 1e-6, 0.004, -0.0099])
def test_a_link_that_hangs_straight_rests_between_its_teeth(beside: float, pendulum: Any) -> None:
    """Either tooth would push it to the other, however far the motor stands to one side of the lowest point."""
    plant = Plant(pendulum.robot, [Backlash(joint=1, gap=0.02, contact_stiffness=1e4, rotor_inertia=0.1)])
    plant.place(np.array([beside - np.pi / 2]))
    assert plant.state.link_position[0] == pytest.approx(-np.pi / 2, abs=1e-12)


@pytest.mark.slow
def test_teeth_lift_off_and_meet(pendulum: Any, pendulum_trial: Any) -> None:
    """Weightless link and small friction: the load reverses often, and the twist crosses the whole gap."""
    loose = pendulum.__class__(moment=1e-9, stiction=0.05, stribeck=0.0, viscous=0.02)
    trial = pendulum_trial.__class__(np.zeros(1), pendulum_trial.torque - 4.0)
    effect = Backlash(joint=1, gap=0.02, contact_stiffness=2000.0, contact_damping=5.0, rotor_inertia=0.1)
    simulated = trial.simulate(loose.robot, [effect], step_s=2.5e-4)
    rates = two_mass(loose, lambda twist, rate: teeth(twist, rate, 0.02, 2000.0, 5.0), 0.1)
    expected = trial.integrate(rates, np.zeros(4), tolerance=1e-8)
    twist = simulated["motor_position"] - simulated["link_position"]
    assert np.min(twist) < -0.01
    assert np.max(twist) > 0.01
    np.testing.assert_allclose(simulated["motor_position"][:, 0], expected[:, 1], rtol=0, atol=3e-4)
    np.testing.assert_allclose(simulated["link_position"][:, 0], expected[:, 0], rtol=0, atol=3e-4)


@pytest.mark.parametrize(
    ("place", "side"), [(0.3, 0.001), (-np.pi + 0.3, -0.0), (-np.pi / 2, 0.0), (-np.pi / 2 + 1e-4, 0.0)]
)
def test_a_link_hangs_in_its_backlash(place: float, side: float, pendulum: Any) -> None:
    """On the tooth that carries its weight; inside the gap where it hangs straight down."""
    effect = Backlash(joint=1, gap=0.002, contact_stiffness=2e4, rotor_inertia=0.1)
    plant = Plant(pendulum.robot, [effect])
    plant.place([place])
    state = plant.state
    link = state.link_position[0]
    weight = pendulum.gravity(link)
    if abs(np.cos(place)) < 1e-3:
        assert weight == pytest.approx(0.0, abs=1e-6)
        assert abs(place - link) <= 0.001
    else:
        assert place - link == pytest.approx(np.sign(weight) * 0.001 + weight / 2e4, rel=1e-9)


def test_friction_and_cogging_act_on_the_motor(pendulum: Any) -> None:
    """A stiff spring between the masses: torque periodic in the motor's angle, seen from there."""
    effects = [
        JointElasticity(joint=1, stiffness=800.0, rotor_inertia=0.1),
        Cogging(joint=1, amplitude=[2.0], order=[30.0]),
    ]
    plant = Plant(pendulum.robot, effects)
    plant.place([0.3])
    state = plant.state
    hold = pendulum.gravity(state.link_position[0]) + 2.0 * np.sin(30.0 * 0.3)
    plant.advance([hold], 1.0)
    np.testing.assert_allclose(plant.state.motor_position, 0.3, rtol=0, atol=1e-9)


def simulated_start(pendulum: Any, effects: list[Any], trial: Any) -> float:
    plant = Plant(pendulum.robot, effects)
    plant.place(trial.start)
    return float(plant.state.link_position[0])
