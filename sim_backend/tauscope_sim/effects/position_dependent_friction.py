"""Friction whose level varies with the joint angle: τ = c A(v) sin(k q + φ).

c in Nm (N), k in periods of 2π a radian (1/m), φ in rad, A(v) = (2/π) arctan(K_v v).
"""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import FrictionLaw, Law
from tauscope_sim.friction import smooth_sign, smooth_sign_slope


class PositionDependentFriction(FrictionLaw):
    """τ = c A(v) sin(k q + φ).

    joint : int
        its number, counted from 1
    k_v : float or None
        K_v; that of the joint's friction_shape where None [s/rad or s/m]
    amplitude : float
        c [Nm or N]
    phase : float
        φ [rad]
    """

    effect_id: ClassVar[str] = "position_dependent_friction"
    amplitude: Number
    order: Positive = 1.0
    phase: Number = 0.0

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        k_v = self.steepness(robot)

        def torque(q: float, v: float) -> float:
            return self.amplitude * smooth_sign(v, k_v) * math.sin(self.order * q + self.phase)

        def slopes(q: float, v: float) -> tuple[float, float]:
            angle = self.order * q + self.phase
            by_position = self.amplitude * smooth_sign(v, k_v) * self.order * math.cos(angle)
            return by_position, self.amplitude * smooth_sign_slope(v, k_v) * math.sin(angle)

        return torque, slopes
