"""Rosenbrock-W integration of the plant, second order and stable for stiff friction, contacts and bristles.

ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999): with W = 1 - γ h J,

    W k₁ = f(y),      W k₂ = f(y + h k₁) - 2 k₁,      y⁺ = y + 3/2 h k₁ + 1/2 h k₂,

of order two whatever matrix J is (so J holds only what is stiff: friction, stiffness, bristles), and L-stable for
γ = 1 - 1/√2 where J is exact. y + h k₁ is of order one: the difference tells the error of a step.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from sim_backend.plant.equations import EquationsOfMotion

Array = NDArray[np.float64]
Factors = tuple[Array, NDArray[np.int32]]

GAMMA = 1.0 - float(np.sqrt(0.5))
"""γ: L-stable, with the smaller of the two error constants."""

UNIT = 0.1
"""Velocity or internal state at which twice the tolerance passes [rad/s, m/s, 1]: reversals of friction lie below."""


class Attempt(NamedTuple):
    """A step that may be taken.

    second_order : (2N + m,) float64
        y⁺
    first_order : (2N + m,) float64
        y + h k₁, the linearly implicit Euler step: it has no fixed points but the true ones, however long the step
    error : float
        largest difference of the two in a velocity or internal state, by what may pass; NaN where there is one
    """

    second_order: Array
    first_order: Array
    error: float


class RosenbrockStep:
    """One step of ROS2 on y = [p, v, z]: positions (N,), velocities (N,) and internal states (m,).

    W is never formed: k_p = r_p + γ h k_v leaves N + m equations, the first N of them multiplied by the mass matrix.

    Parameters
    ----------
    equations : EquationsOfMotion
        f and the stiff part of its Jacobian
    """

    def __init__(self, equations: EquationsOfMotion) -> None:
        self._equations = equations
        self._size = equations.coordinates.size
        total = self._size + equations.state_count
        self._left = np.eye(total)
        self._right = np.empty(total)
        self._stateful = equations.state_count > 0
        self._mass = np.zeros((self._size, self._size))

    def begin(self, time: float, vector: Array, drive: Array) -> None:
        """Evaluate and linearise where steps shall start; a step may then be tried with several lengths.

        Parameters
        ----------
        time : float
            t [s]
        vector : (2N + m,) float64
            y
        drive : (n,) float64
            torque of the drives, constant during the step [Nm or N]
        """
        self._time, self._vector, self._drive = time, vector, drive
        self._rate = self._equations.evaluate(time, vector, drive)
        mass, self._slopes = self._equations.linearise()
        self._mass[:] = mass

    def attempt(self, step: float, tolerance: float) -> Attempt:
        """Take the step and estimate its error.

        Parameters
        ----------
        step : float
            h [s]
        tolerance : float
            error of a velocity or internal state of size zero that may pass; it grows with its size
        """
        scale = GAMMA * step
        factors = self._factors(scale)
        first = self._solve(factors, scale, self._rate)
        predicted = self._vector + step * first
        rate = self._equations.evaluate(self._time + step, predicted, self._drive)
        rate -= 2.0 * first
        second = self._solve(factors, scale, rate)
        difference = (0.5 * step) * (first + second)
        allowed = tolerance + (tolerance / UNIT) * np.abs(self._vector[self._size :])
        error = float((np.abs(difference[self._size :]) / allowed).max())
        return Attempt(predicted + difference, predicted, error)

    def _factors(self, scale: float) -> Factors:
        """LU factors of W with the rates of the positions eliminated."""
        size, slopes, left = self._size, self._slopes, self._left
        left[:size, :size] = self._mass + scale * (slopes.by_velocity + scale * slopes.by_position)
        if self._stateful:
            left[:size, size:] = scale * slopes.by_state
            left[size:, :size] = -scale * (slopes.rate_by_velocity + scale * slopes.rate_by_position)
            left[size:, size:] = np.eye(len(left) - size) - scale * slopes.rate_by_state
        factors, pivots, _ = dgetrf(left)
        return factors, pivots

    def _solve(self, factors: Factors, scale: float, right_side: Array) -> Array:
        """Solve W k = r."""
        size, slopes, right = self._size, self._slopes, self._right
        position = right_side[:size]
        right[:size] = self._mass.dot(right_side[size : 2 * size])
        right[:size] -= scale * slopes.by_position.dot(position)
        if self._stateful:
            right[size:] = right_side[2 * size :] + scale * slopes.rate_by_position.dot(position)
        solution = np.empty_like(right_side)
        solution[size:] = dgetrs(*factors, right)[0]
        solution[:size] = position + scale * solution[size : 2 * size]
        return solution
