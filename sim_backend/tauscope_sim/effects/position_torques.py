"""Torques that follow a joint's position: springs, cables, a constant."""

from typing import Annotated, ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import JointLaw, Law, Side
from tauscope_sim.effects.fields import Exponent, one_of


class JointSpring(JointLaw):
    """τ = k (q - q₀), between two links: the transmission carries it.

    `joint`: its number, counted from 1.
    `stiffness`: k [Nm/rad or N/m].
    `rest`: q₀, where the spring is slack [rad or m].
    """

    effect_id: ClassVar[str] = "joint_spring"
    side: ClassVar[Side] = Side.LINK
    stiffness: Number
    rest: Number = 0.0

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (lambda q, v: self.stiffness * (q - self.rest)), (lambda q, v: (self.stiffness, 0.0))


LEAST_STRETCH = 1e-6
"""Below this the slope of a root is taken as here [rad or m]."""


class CableForce(JointLaw):
    """τ = ±k max(±(q - q_c), 0)^p, between two links: the transmission carries it.

    `joint`: its number, counted from 1.
    `stiffness`: k [Nm/rad^p or N/m^p].
    `angle`: q_c, where it begins [rad or m].
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


class TorqueOffset(JointLaw):
    """τ = c.

    `joint`: its number, counted from 1.
    `torque`: c [Nm or N].
    """

    effect_id: ClassVar[str] = "torque_offset"
    torque: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (lambda q, v: self.torque), (lambda q, v: (0.0, 0.0))
