"""Torques, mass matrix and energies: against Pinocchio, and by the identities of mechanics."""

from collections.abc import Callable

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arms import random_arm, random_parameters, random_states
from pinocchio_arm import pinocchio_model
from tauscope.dynamics.regressor import CHUNK
from tauscope.dynamics.rigid_body import gravity_torque, inverse_dynamics, mass_matrix
from tauscope.robot.kinematics import link_placements
from tauscope.robot.robot import LinkInertia, Robot

SAMPLES = 6
ARMS = given(seed=st.integers(0, 2**32 - 1), joint_count=st.integers(1, 7))


def some_arm(seed: int, joint_count: int) -> tuple[Robot, np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """A random chain, its parameters, and states."""
    rng = np.random.default_rng(seed)
    return random_arm(rng, joint_count), random_parameters(rng, joint_count), random_states(rng, SAMPLES, joint_count)


def kinetic_energy(robot: Robot, parameters: np.ndarray, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """T = ½ q̇ᵀ H(q) q̇ [J]."""
    return 0.5 * np.einsum("ni,nik,nk->n", qd, mass_matrix(robot, parameters, q), qd)


def potential_energy(robot: Robot, parameters: np.ndarray, q: np.ndarray) -> np.ndarray:
    """U = -gᵀ Σ_j (m_j p_j + R_j m_j s_j), zero at the base frame's origin [J]."""
    energy = np.zeros(len(q))
    for vector, placement in zip(parameters.reshape(-1, 10), link_placements(robot, q).swapaxes(0, 1), strict=True):
        link, rotation, position = LinkInertia.from_vector(vector), placement[:, :3, :3], placement[:, :3, 3]
        energy -= (link.mass * position + rotation @ link.first_moment) @ robot.gravity
    return energy


def close(actual: np.ndarray, expected: np.ndarray, relative: float = 1e-9) -> None:
    """Equal to a share of the largest entry."""
    np.testing.assert_allclose(
        actual, expected, rtol=0, atol=relative * max(float(np.abs(expected).max(initial=0.0)), 1e-3)
    )


def derivative(function: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Central difference of sixth order of a function of one variable, at zero."""
    weights = ((1, 0.75), (2, -0.15), (3, 1 / 60))
    return np.sum([weight * (function(k * h) - function(-k * h)) for k, weight in weights], axis=0) / h


@ARMS
def test_pinocchio_agrees(seed: int, joint_count: int) -> None:
    robot, parameters, (q, qd, qdd) = some_arm(seed, joint_count)
    model = pinocchio_model(robot, parameters)
    data = model.createData()
    close(
        inverse_dynamics(robot, parameters, q, qd, qdd),
        np.array([pinocchio.rnea(model, data, *x) for x in zip(q, qd, qdd, strict=True)]),
    )
    close(
        gravity_torque(robot, parameters, q), np.array([pinocchio.computeGeneralizedGravity(model, data, x) for x in q])
    )
    upper = np.array([np.triu(pinocchio.crba(model, data, x)) for x in q])
    close(np.triu(mass_matrix(robot, parameters, q)), upper)
    close(
        kinetic_energy(robot, parameters, q, qd),
        np.array([pinocchio.computeKineticEnergy(model, data, *x) for x in zip(q, qd, strict=True)]),
    )
    close(
        potential_energy(robot, parameters, q), np.array([pinocchio.computePotentialEnergy(model, data, x) for x in q])
    )


@ARMS
def test_mass_matrix_is_symmetric_and_positive_definite(seed: int, joint_count: int) -> None:
    robot, parameters, (q, _, _) = some_arm(seed, joint_count)
    mass = mass_matrix(robot, parameters, q)
    close(mass, mass.transpose(0, 2, 1), 1e-12)
    assert (np.linalg.eigvalsh(mass) > 0).all()


@ARMS
def test_mass_matrix_is_what_accelerations_cost(seed: int, joint_count: int) -> None:
    robot, parameters, (q, qd, qdd) = some_arm(seed, joint_count)
    cost = inverse_dynamics(robot, parameters, q, qd, qdd) - inverse_dynamics(
        robot, parameters, q, qd, np.zeros_like(q)
    )
    close(cost, np.einsum("nik,nk->ni", mass_matrix(robot, parameters, q), qdd))


@ARMS
def test_power_is_the_rate_of_energy(seed: int, joint_count: int) -> None:
    robot, parameters, (q, qd, qdd) = some_arm(seed, joint_count)

    def energy(time: float) -> np.ndarray:
        position, velocity = q + qd * time + qdd * time**2 / 2, qd + qdd * time
        return kinetic_energy(robot, parameters, position, velocity) + potential_energy(robot, parameters, position)

    power = np.einsum("ni,ni->n", qd, inverse_dynamics(robot, parameters, q, qd, qdd))
    close(derivative(energy, 1e-3), power, 1e-7)


@ARMS
def test_gravity_torque_is_the_slope_of_potential_energy(seed: int, joint_count: int) -> None:
    robot, parameters, (q, _, _) = some_arm(seed, joint_count)
    slopes = [
        derivative(lambda step, unit=unit: potential_energy(robot, parameters, q + step * unit), 1e-2)
        for unit in np.eye(joint_count)
    ]
    close(gravity_torque(robot, parameters, q), np.stack(slopes, axis=1), 1e-8)


@ARMS
def test_coriolis_torque_leaves_mass_rate_minus_twice_coriolis_skew(seed: int, joint_count: int) -> None:
    """H' - 2 C is skew: q̇ᵀ(H' q̇ - 2 C q̇) = 0 with C q̇ = h, the velocity-dependent torque."""
    robot, parameters, (q, qd, _) = some_arm(seed, joint_count)
    rest = np.zeros_like(q)
    h = inverse_dynamics(robot, parameters, q, qd, rest) - gravity_torque(robot, parameters, q)
    rate = derivative(lambda time: mass_matrix(robot, parameters, q + qd * time), 1e-3)
    close(np.einsum("ni,nik,nk->n", qd, rate, qd), 2 * np.einsum("ni,ni->n", qd, h), 1e-7)


@pytest.mark.parametrize("samples", [0, 1, CHUNK + 1])
def test_any_number_of_samples(samples: int) -> None:
    rng = np.random.default_rng(6)
    robot, parameters = random_arm(rng, 3), random_parameters(rng, 3)
    q, qd, qdd = random_states(rng, samples, 3)
    torque = inverse_dynamics(robot, parameters, q, qd, qdd)
    mass = mass_matrix(robot, parameters, q)
    assert torque.shape == (samples, 3)
    assert mass.shape == (samples, 3, 3)
    last = slice(max(samples - 1, 0), samples)
    close(torque[last], inverse_dynamics(robot, parameters, q[last], qd[last], qdd[last]))
    close(mass[last], mass_matrix(robot, parameters, q[last]))
