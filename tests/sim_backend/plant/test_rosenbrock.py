"""The step of the integration against its own definition, with the matrix W formed and solved as it is printed."""

from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope_sim.plant.equations import EquationsOfMotion
from tauscope_sim.plant.rosenbrock import GAMMA, UNIT, RosenbrockStep
from tauscope_sim.plant.term import Coordinates, Slopes

Array = NDArray[np.float64]

SIZE, STEP, TOLERANCE = 3, 1e-3, 1e-4


class LinearSystem:
    """Stands in for the equations of motion: y' = J y + b with chosen slopes, which may change with every step."""

    def __init__(self, rng: np.random.Generator, states: int) -> None:
        self.coordinates = Coordinates(SIZE)
        self.state_count = states
        self._rng = rng
        self.slopes = Slopes(SIZE, states)
        self.offset = rng.standard_normal(2 * SIZE + states)
        self.change(with_position=True)

    def change(self, *, with_position: bool) -> None:
        """Other slopes; torque that depends on positions, or none that does."""
        root = self._rng.standard_normal((SIZE, SIZE))
        self.mass = root @ root.T + SIZE * np.eye(SIZE)
        self.slopes.all[:] = 0.0
        parts = [self.slopes.by_velocity, self.slopes.by_state, self.slopes.rate_by_velocity, self.slopes.rate_by_state]
        if with_position:
            parts += [self.slopes.by_position, self.slopes.rate_by_position]
        for part in parts:
            part[:] = 50.0 * self._rng.standard_normal(part.shape)

    @property
    def jacobian(self) -> Array:
        """J, (2N + m, 2N + m)."""
        slopes = self.slopes
        inverse = np.linalg.inv(self.mass)
        return np.block(
            [
                [np.zeros((SIZE, SIZE)), np.eye(SIZE), np.zeros((SIZE, self.state_count))],
                [-inverse @ slopes.by_position, -inverse @ slopes.by_velocity, -inverse @ slopes.by_state],
                [slopes.rate_by_position, slopes.rate_by_velocity, slopes.rate_by_state],
            ]
        )

    def evaluate(self, time: float, vector: list[float], drive: list[float]) -> list[float]:
        with np.errstate(invalid="ignore"):
            return (self.jacobian @ np.array(vector) + self.offset).tolist()

    def linearise(self) -> tuple[Array, Slopes]:
        return self.mass, self.slopes


def by_definition(system: LinearSystem, vector: Array, step: float) -> tuple[Array, Array]:
    """y⁺ and y + h k₁ of ROS2."""
    w = np.eye(len(vector)) - GAMMA * step * system.jacobian
    first = np.linalg.solve(w, system.evaluate(0.0, vector.tolist(), []))
    rate = np.array(system.evaluate(step, (vector + step * first).tolist(), []))
    second = np.linalg.solve(w, rate - 2.0 * first)
    return vector + 1.5 * step * first + 0.5 * step * second, vector + step * first


@pytest.mark.parametrize("states", [0, 2])
def test_a_step_is_what_its_definition_says(states: int) -> None:
    rng = np.random.default_rng(states)
    system = LinearSystem(rng, states)
    step = RosenbrockStep(cast(EquationsOfMotion, cast(Any, system)))
    # slopes by position come and go, as in a backlash
    for with_position in (True, False, False, True, False):
        system.change(with_position=with_position)
        vector = rng.standard_normal(2 * SIZE + states)
        step.begin(0.0, vector.tolist(), [])
        for length in (STEP, 0.25 * STEP):
            attempt = step.attempt(length, TOLERANCE)
            second_order, first_order = by_definition(system, vector, length)
            np.testing.assert_allclose(attempt.second_order, second_order, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(attempt.first_order, first_order, rtol=1e-12, atol=1e-12)
            passes = TOLERANCE * (1.0 + np.abs(vector[SIZE:]) / UNIT)
            largest = float((np.abs(second_order - first_order)[SIZE:] / passes).max())
            assert attempt.error == pytest.approx(largest, rel=1e-9)


def test_an_error_that_is_no_number_is_told() -> None:
    system = LinearSystem(np.random.default_rng(0), 0)
    system.offset[-1] = np.inf
    step = RosenbrockStep(cast(EquationsOfMotion, cast(Any, system)))
    step.begin(0.0, [0.0] * 2 * SIZE, [])
    assert np.isnan(step.attempt(STEP, TOLERANCE).error)
