"""The gradient through the regressor against finite differences of the regressor itself."""

from collections.abc import Callable

import numpy as np
import pytest

from arms import Array, panda_like, paper_arm, random_arm, random_states, ur5_like
from tauscope.dynamics import torque_regressor
from tauscope.dynamics.regressor_gradient import Columns, RegressorGradient
from tauscope.robot import Robot

STEP = 1e-3
WEIGHTS = {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}


def differences(
    robot: Robot, states: tuple[Array, Array, Array], weight: Array, columns: Columns | None
) -> list[Array]:
    """∂S/∂(q, q̇, q̈) by sixth-order central differences, each (N, n)."""

    def scalar(shifted: list[Array]) -> Array:
        return np.einsum("icn,nic->n", weight, torque_regressor(robot, *shifted, columns=columns))

    results = []
    for kind in range(3):
        result = np.zeros_like(states[kind])
        for joint in range(robot.joint_count):
            for multiple, share in WEIGHTS.items():
                for sign in (1.0, -1.0):
                    shifted = [array.copy() for array in states]
                    shifted[kind][:, joint] += sign * multiple * STEP
                    result[:, joint] += sign * share * scalar(shifted) / STEP
        results.append(result)
    return results


def assert_matches(robot: Robot, rng: np.random.Generator, columns: Columns | None = None) -> None:
    count = 10 * robot.joint_count if columns is None else len(columns)
    states = random_states(rng, 5, robot.joint_count)
    weight = rng.normal(size=(robot.joint_count, count, 5))
    found = RegressorGradient(robot, columns=columns, capacity=5).contract(*states, weight)
    expected = differences(robot, states, weight, columns)
    size = max(np.abs(part).max() for part in expected)
    for part, oracle in zip(found, expected, strict=True):
        np.testing.assert_allclose(part, oracle, rtol=0.0, atol=1e-8 * size)


@pytest.mark.parametrize("arm", [paper_arm, ur5_like, panda_like])
def test_named_arms(arm: Callable[[], Robot]) -> None:
    assert_matches(arm(), np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(12))
def test_random_chains_with_prismatic_joints(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert_matches(random_arm(rng, 1 + seed % 7), rng)


def test_some_columns_only() -> None:
    rng = np.random.default_rng(3)
    columns = np.array([5, 6, 7, 12, 20, 21, 29, 33])
    assert_matches(random_arm(rng, 4), rng, columns)


def test_every_sample_by_itself() -> None:
    rng = np.random.default_rng(4)
    robot = random_arm(rng, 3)
    states = random_states(rng, 6, 3)
    weight = rng.normal(size=(3, 30, 6))
    together = RegressorGradient(robot, capacity=6).contract(*states, weight)
    for sample in range(6):
        one = slice(sample, sample + 1)
        q, qd, qdd = (array[one] for array in states)
        alone = RegressorGradient(robot, capacity=1).contract(q, qd, qdd, weight[:, :, one])
        for part, whole in zip(alone, together, strict=True):
            np.testing.assert_allclose(part[0], whole[sample], rtol=1e-12, atol=1e-12)
