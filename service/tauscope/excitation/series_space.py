"""Fourier series that rest at the ends of their period, as free vectors: what the optimiser moves in.

Velocity and acceleration are zero at both ends of a period exactly where Σ_l a_l = 0 and Σ_l l b_l = 0. A basis of
these coefficients leaves 2 (M - 1) free numbers a joint, and its centre.
"""

import numpy as np
from scipy.linalg import null_space

from tauscope.errors import ExcitationError
from tauscope.excitation.information import MotionGradient
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import LEAST_HARMONICS, FourierSeries, MotionSamples
from tauscope.trajectory.limits import MotionLimits


class SeriesSpace:
    """Series of one period and harmonics as vectors x. Raises ExcitationError for too few harmonics.

    Row j is (centre, coefficients): the centre as part of half the position range away from its middle, the
    coefficients as parts of the speed limit. All entries are of order one. `period_s`: fundamental period [s].
    """

    def __init__(self, limits: MotionLimits, period_s: float, harmonics: int) -> None:
        if harmonics < LEAST_HARMONICS:
            raise ExcitationError(
                f"{harmonics} harmonics: a motion that rests at its ends needs at least {LEAST_HARMONICS}"
            )
        self.period_s = period_s
        self.harmonics = harmonics
        self.joint_count = len(limits.velocity)
        self.columns = 1 + 2 * (harmonics - 1)
        self._limits = limits
        self._order = np.arange(1.0, harmonics + 1.0)
        # Higher harmonics weigh less in position, more in acceleration: the same scale suits all in velocity.
        self._cosine = null_space(np.ones((1, harmonics)))
        self._sine = null_space(self._order[None])

    def series(self, x: Array) -> FourierSeries:
        """The series of a vector. `x`: (n, columns), centre and coefficients."""
        limits, free = self._limits, self.harmonics - 1
        speed = limits.velocity[:, None]
        return FourierSeries(
            self.period_s,
            limits.middle + limits.half_range * x[:, 0],
            speed * (x[:, 1 : 1 + free] @ self._cosine.T),
            speed * (x[:, 1 + free :] @ self._sine.T),
        )

    def grid(self, samples: int) -> "SeriesGrid":
        """Equispaced instants of one period."""
        omega = 2.0 * np.pi / self.period_s * self._order
        phase = np.multiply.outer(np.arange(samples) * (self.period_s / samples), omega)
        cosine, sine = np.cos(phase), np.sin(phase)
        bases = (
            np.hstack([sine / omega @ self._cosine, -cosine / omega @ self._sine]),
            np.hstack([cosine @ self._cosine, sine @ self._sine]),
            np.hstack([-sine * omega @ self._cosine, cosine * omega @ self._sine]),
        )
        return SeriesGrid(self._limits, bases)


class SeriesGrid:
    """Motion at fixed instants by the vector x; `bases`: (K, 2 (M - 1)) of q, q̇ and q̈ by coefficient."""

    def __init__(self, limits: MotionLimits, bases: tuple[Array, Array, Array]) -> None:
        self._limits = limits
        self._bases = bases

    @property
    def samples(self) -> int:
        """Number of instants K."""
        return len(self._bases[0])

    def motion(self, x: Array) -> MotionSamples:
        """Position, velocity and acceleration at the instants. `x`: (n, columns), centre and coefficients."""
        limits = self._limits
        position, velocity, acceleration = (basis @ x[:, 1:].T * limits.velocity for basis in self._bases)
        return MotionSamples(position + limits.middle + limits.half_range * x[:, 0], velocity, acceleration)

    def pull_back(self, gradient: MotionGradient) -> Array:
        """Derivatives by x of a scalar, (n, columns), from those by the motion."""
        parts = (gradient.position, gradient.velocity, gradient.acceleration)
        speed = self._limits.velocity[:, None]
        coefficients = np.sum([part.T @ basis for part, basis in zip(parts, self._bases, strict=True)], axis=0)
        return np.column_stack([gradient.position.sum(axis=0) * self._limits.half_range, coefficients * speed])
