"""Extra friction near zero velocity that decays with speed: τ = c A(v) exp(-(|v|/v_s)^α).

c in Nm (N), v_s in rad/s (m/s), α without unit, A(v) = (2/π) arctan(K_v v).
"""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.fields import Exponent
from tauscope_sim.effects.joint_law import FrictionLaw, Law
from tauscope_sim.friction import smooth_sign, smooth_sign_slope


class StribeckFriction(FrictionLaw):
    """τ = c A(v) exp(-(|v|/v_s)^α).

    joint : int
        its number, counted from 1
    k_v : float or None
        K_v; that of the joint's friction_shape where None [s/rad or s/m]
    amplitude : float
        c [Nm or N]
    velocity : float
        v_s [rad/s or m/s]
    """

    effect_id: ClassVar[str] = "stribeck_friction"
    amplitude: Number
    velocity: Positive
    exponent: Exponent = 2.0

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        k_v = self.steepness(robot)

        def decay(v: float) -> float:
            return math.exp(-((abs(v) / self.velocity) ** self.exponent))

        def torque(q: float, v: float) -> float:
            return self.amplitude * smooth_sign(v, k_v) * decay(v)

        def slopes(q: float, v: float) -> tuple[float, float]:
            # d exp(-x^α)/dv = -α x^α / v exp(-x^α), taken as zero at rest where A(v) vanishes too
            power = self.exponent * (abs(v) / self.velocity) ** self.exponent
            fall = smooth_sign(v, k_v) * power / v if v else 0.0
            return 0.0, self.amplitude * decay(v) * (smooth_sign_slope(v, k_v) - fall)

        return torque, slopes
