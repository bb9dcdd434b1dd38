"""The inertia by which the simulated drives scale their gains, as a commissioned arm's drives are tuned to it."""

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import PhysicalEffect

Array = NDArray[np.float64]

LARGEST_EXCESS = 4.0
"""The damping of a drive with a compliant transmission is tuned to at most this many times its rotor's inertia."""

STIFFNESS_EXCESS = 5.0
"""Its stiffness may be tuned to so many times more."""


class InertiaSchedule:
    """H(q) and gravity of the arm as it really is, concealed payloads and rotors included.

    For a joint with a compliant transmission H is scaled down to a multiple of its rotor's inertia, which is all that
    the drive feels between two ticks.
    """

    def __init__(self, robot: Robot, effects: Sequence[PhysicalEffect]) -> None:
        real = reduce(lambda arm, effect: effect.alter(arm), effects, robot)
        rotors = sum((effect.added_rotor_inertia(real) for effect in effects), np.zeros(real.joint_count))
        self._bodies = RigidBodies(real, rotors)
        self._rest = np.zeros(real.joint_count)
        self._largest = np.full(real.joint_count, np.inf)
        for effect in effects:
            if (transmission := effect.transmission()) is not None:
                self._largest[transmission.joint - 1] = LARGEST_EXCESS * transmission.rotor_inertia
        self.compliant = np.isfinite(self._largest)
        """joints with a compliant transmission, (n,)"""
        self._rigid = not self.compliant.any()

    def at(self, position: Array) -> tuple[Array, Array, Array]:
        """What scales damping and stiffness, and what carries the resting arm; overwritten by the next call.

        Parameters
        ----------
        position : (n,) float64
            q [rad or m]

        Returns
        -------
        damping : (n, n) float64
            H(q), scaled down where transmissions are compliant [kg m² or kg]
        stiffness : (n, n) float64
            likewise, less so [kg m² or kg]
        load : (n,) float64
            gravity's torque [Nm or N]
        """
        self._bodies.update(position, self._rest)
        matrix, load = self._bodies.mass_matrix(), self._bodies.bias
        if self._rigid:
            return matrix, matrix, load
        return self._scale(matrix, 1.0), self._scale(matrix, STIFFNESS_EXCESS), load

    def _scale(self, matrix: Array, excess: float) -> Array:
        """H with the rows and columns of compliant joints scaled down; it stays positive definite."""
        scale = np.sqrt(np.minimum(1.0, excess * self._largest / matrix.diagonal()))
        return matrix * np.multiply.outer(scale, scale)
