"""Rosenbrock-W integration of the plant, second order and stable for stiff friction, contacts and bristles.

ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999): with W = 1 - γ h J,

    W k₁ = f(y),      W k₂ = f(y + h k₁) - 2 k₁,      y⁺ = y + 3/2 h k₁ + 1/2 h k₂,

of order two whatever matrix J is (so J holds only what is stiff: friction, stiffness, bristles), and L-stable for
γ = 1 - 1/√2 where J is exact. y + h k₁ is of order one: the difference tells the error of a step.
"""

from math import isfinite, nan
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgesv

from tauscope.robot.robot import Array
from tauscope_sim.plant.equations import EquationsOfMotion

GAMMA = 1.0 - float(np.sqrt(0.5))  # γ: L-stable, with the smaller of the two error constants

# Velocity or internal state at which twice the tolerance passes [rad/s, m/s, 1]: reversals of friction lie below
UNIT = 0.1


class Attempt(NamedTuple):
    """A step that may be taken; states as lists, 2N + m numbers each."""

    second_order: list[float]
    first_order: list[float]
    error: float


class RosenbrockStep:
    """One step of ROS2 on y = [p, v, z]: positions (N,), velocities (N,) and internal states (m,).

    k_p = r_p + s k_v with s = γ h leaves N + m equations for κ = [k_v, k_z], the first N of them multiplied by the mass
    matrix M. With the slopes P, V, Z of torque and P', V', Z' of the states' rates by position, velocity and state:

        [M + s V + s² P,        s Z]  κ  =  [-s P,  M,  0]  r.
        [-s V' - s² P',   1 - s Z' ]        [ s P', 0,  1]

    It is solved once an attempt, for the matrix K with κ = K r. States are lists: a call into NumPy takes longer than
    the few numbers of an arm.
    """

    def __init__(self, equations: EquationsOfMotion) -> None:
        self._equations = equations
        size, states = equations.coordinates.size, equations.state_count
        self._size, self._stateful = size, states > 0
        self._sign = np.concatenate([np.ones(size), -np.ones(states)])[:, None]
        self._left = np.eye(size + states)
        self._right = np.eye(size + states, 2 * size + states, size)
        self._by_position: Array | None = None

    def begin(self, time: float, vector: list[float], drive: list[float]) -> None:
        """Evaluate and linearise at t [s], for steps of several lengths. `drive`: one a joint, constant [Nm or N]."""
        size = self._size
        self._time, self._vector, self._drive = time, vector, drive
        self._rate = self._equations.evaluate(time, vector, drive)
        mass, slopes = self._equations.linearise()
        self._left[:size, :size] = mass
        self._right[:size, size : 2 * size] = mass
        self._slopes = self._sign * (slopes.all[1] + slopes.all[2]) if self._stateful else slopes.by_velocity
        if np.count_nonzero(slopes.all[0]):
            self._by_position = self._sign * slopes.all[0]
        elif self._by_position is not None:
            self._by_position = None
            self._right[:, :size] = 0.0
        self._passing = [1.0 + abs(value) / UNIT for value in vector[size:]]

    def attempt(self, step: float, tolerance: float) -> Attempt:
        """Take the step and estimate its error. `step`: h [s]."""
        scale = GAMMA * step
        solution = self._solution(scale)
        first = self._solve(solution, scale, self._rate)
        predicted = [y + step * k for y, k in zip(self._vector, first, strict=True)]
        rate = self._equations.evaluate(self._time + step, predicted, self._drive)
        second = self._solve(solution, scale, [r - 2.0 * k for r, k in zip(rate, first, strict=True)])
        half = 0.5 * step
        difference = [half * (k + other) for k, other in zip(first, second, strict=True)]
        error = _largest(difference[self._size :], self._passing) / tolerance
        return Attempt([y + d for y, d in zip(predicted, difference, strict=True)], predicted, error)

    def _solution(self, scale: float) -> Array:
        left = self._left + scale * self._slopes
        if self._by_position is not None:
            left += (scale * scale) * self._by_position
            self._right[:, : self._size] = -scale * self._by_position[:, : self._size]
        return dgesv(left, self._right)[2]

    def _solve(self, solution: Array, scale: float, right_side: list[float]) -> list[float]:
        rates = solution.dot(right_side).tolist()
        return [r + scale * k for r, k in zip(right_side[: self._size], rates, strict=False)] + rates


def _largest(differences: list[float], passing: list[float]) -> float:
    """Largest difference by what may pass; NaN where one is not finite."""
    errors = [abs(difference) / passes for difference, passes in zip(differences, passing, strict=True)]
    return max(errors) if all(map(isfinite, errors)) else nan
