"""One-sided elastic torque past an angle, a hose, cable or end stop.

τ = k (q - q_c)^p for q > q_c where it acts above, τ = -k (q_c - q)^p for q < q_c where it acts below, else 0;
k in Nm/rad^p (N/m^p).
"""

from typing import Annotated, ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.fields import Exponent, one_of
from tauscope_sim.effects.joint_law import JointLaw, Law, Side

LEAST_STRETCH = 1e-6
"""Below this the slope of a root is taken as here [rad or m]."""


class CableForce(JointLaw):
    """τ = ±k max(±(q - q_c), 0)^p, between two links: the transmission carries it.

    joint : int
        its number, counted from 1
    stiffness : float
        k [Nm/rad^p or N/m^p]
    angle : float
        q_c, where it begins [rad or m]
    """

    effect_id: ClassVar[str] = "cable_force"
    side: ClassVar[Side] = Side.LINK
    stiffness: Positive
    angle: Number
    side_of_angle: Annotated[str, one_of("above", "below")] = "above"
    exponent: Exponent = 1.5

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        sign = 1.0 if self.side_of_angle == "above" else -1.0

        def torque(q: float, v: float) -> float:
            return sign * self.stiffness * max(sign * (q - self.angle), 0.0) ** self.exponent

        def slopes(q: float, v: float) -> tuple[float, float]:
            stretch = sign * (q - self.angle)
            if stretch <= 0.0:
                return 0.0, 0.0
            # below p = 1 the slope has no bound at the beginning; the implicit part needs none
            return self.stiffness * self.exponent * max(stretch, LEAST_STRETCH) ** (self.exponent - 1.0), 0.0

        return torque, slopes
