"""Reflected inertia of a motor: τ = J q̈, J in kg m² (kg). Its gyroscopic effect is left out, as is usual."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.document_fields import Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import JointEffect

Array = NDArray[np.float64]


class RotorInertia(JointEffect):
    """τ = J q̈.

    joint : int
        its number, counted from 1
    inertia : float
        J, the rotor's inertia times the square of the gear ratio [kg m² or kg]
    """

    effect_id: ClassVar[str] = "rotor_inertia"
    inertia: Positive

    def added_rotor_inertia(self, robot: Robot) -> Array:
        """J at its joint, (n,) [kg m² or kg]."""
        inertia = np.zeros(robot.joint_count)
        inertia[self.index] = self.inertia
        return inertia
