"""Friction with a power of speed other than one: τ = c sgn(v) (|v|/v₁)^p with v₁ = 1 rad/s (1 m/s); c in Nm (N)."""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.fields import Exponent
from tauscope_sim.effects.joint_law import JointLaw, Law, Side

LEAST_SPEED = 1e-3
"""Below this the slope of a root is taken as here: it has none at zero [rad/s or m/s]."""


class NonlinearViscous(JointLaw):
    """τ = c sgn(v) |v|^p.

    joint : int
        its number, counted from 1
    amplitude : float
        c, friction at 1 rad/s or 1 m/s [Nm or N]
    """

    effect_id: ClassVar[str] = "nonlinear_viscous"
    side: ClassVar[Side] = Side.FRICTION
    amplitude: Number
    exponent: Exponent

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""

        def torque(q: float, v: float) -> float:
            return math.copysign(self.amplitude * abs(v) ** self.exponent, self.amplitude * v)

        def slopes(q: float, v: float) -> tuple[float, float]:
            return 0.0, self.amplitude * self.exponent * max(abs(v), LEAST_SPEED) ** (self.exponent - 1.0)

        return torque, slopes
