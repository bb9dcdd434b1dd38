"""Torques that follow a joint's angle: cogging and the ripple of a gear under load, springs, cables, a constant."""

import math
from typing import Annotated, ClassVar

from pydantic import Field

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import Exponent, JointLaw, Law, Numbers, Side, one_of
from tauscope_sim.plant.term import LARGEST_GAIN


class Cogging(JointLaw):
    """τ = Σ a_i sin(k_i q' + φ_i), with q' = q, or gear ratio × q where it is periodic in the motor's angle."""

    effect_id: ClassVar[str] = "cogging"
    amplitude: Numbers  # a_i, a number or one an order [Nm or N]
    order: Numbers
    phase: Numbers = Field(default=[0.0])  # φ_i, a number or one an order [rad]
    angle: Annotated[str, one_of("joint", "motor")] = "joint"

    def check(self, robot: Robot) -> None:
        super().check(robot)
        for key in ("amplitude", "phase"):
            count, wanted = len(getattr(self, key)), len(self.order)
            if count not in (1, wanted):
                raise self.refused(key, f"holds {count} numbers, order {wanted}; give one each, or one for all")
        if self.angle == "motor" and self.joint_of(robot).gear_ratio is None:
            raise self.refused("angle", "is motor, but the robot file states no gear_ratio for this joint; state it")

    def law(self, robot: Robot) -> Law:
        ratio = (self.joint_of(robot).gear_ratio or 1.0) if self.angle == "motor" else 1.0
        count = len(self.order)
        amplitude, phase = (value * count if len(value) == 1 else value for value in (self.amplitude, self.phase))
        parts = [(a, ratio * k, p) for a, k, p in zip(amplitude, self.order, phase, strict=True)]
        return (
            lambda q, v: sum(a * math.sin(k * q + p) for a, k, p in parts),
            lambda q, v: (sum(a * k * math.cos(k * q + p) for a, k, p in parts), 0.0),
        )


class TorqueRipple(Cogging):
    """τ = L Σ a_i sin(k_i q' + φ_i). `amplitude`: a_i [Nm/Nm], `phase`: φ_i [rad]: a number, or one an order."""

    effect_id: ClassVar[str] = "torque_ripple"
    side: ClassVar[Side] = Side.LOAD_GAIN

    def check(self, robot: Robot) -> None:
        super().check(robot)
        repeats = len(self.order) if len(self.amplitude) == 1 else 1
        total = repeats * sum(abs(amplitude) for amplitude in self.amplitude)
        if total > LARGEST_GAIN:
            raise self.refused("amplitude", f"adds up to {total:g} of the load; make it at most {LARGEST_GAIN:g}")


class JointSpring(JointLaw):
    """τ = k (q - q₀), between two links: the transmission carries it."""

    effect_id: ClassVar[str] = "joint_spring"
    side: ClassVar[Side] = Side.LINK
    stiffness: Number  # k [Nm/rad or N/m]
    rest: Number = 0.0  # q₀, where the spring is slack [rad or m]

    def law(self, robot: Robot) -> Law:
        return (lambda q, v: self.stiffness * (q - self.rest)), (lambda q, v: (self.stiffness, 0.0))


LEAST_STRETCH = 1e-6  # below this the slope of a root is taken as here [rad or m]


class CableForce(JointLaw):
    """τ = ±k max(±(q - q_c), 0)^p, between two links: the transmission carries it."""

    effect_id: ClassVar[str] = "cable_force"
    side: ClassVar[Side] = Side.LINK
    stiffness: Positive  # k [Nm/rad^p or N/m^p]
    angle: Number  # q_c, where it begins [rad or m]
    side_of_angle: Annotated[str, one_of("above", "below")] = "above"
    exponent: Exponent = 1.5

    def law(self, robot: Robot) -> Law:
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
    """τ = c."""

    effect_id: ClassVar[str] = "torque_offset"
    torque: Number  # c [Nm or N]

    def law(self, robot: Robot) -> Law:
        return (lambda q, v: self.torque), (lambda q, v: (0.0, 0.0))
