"""Torques that follow a joint's angle: cogging and the ripple of a gear under load, springs, cables, a constant."""

import math
from collections.abc import Callable
from typing import Annotated, ClassVar

from pydantic import Field

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import Exponent, JointEffect, JointLaw, Law, Numbers, Side, one_of, single_zero
from tauscope_sim.plant.term import LARGEST_GAIN, Coordinates, Forces, Moment, Slopes, Term


class AngleHarmonics(JointEffect):
    """s(q) = Σ a_i sin(k_i q' + φ_i), with q' = q, or gear ratio × q where it is periodic in the motor's angle."""

    amplitude: Numbers
    order: Numbers
    phase: Numbers = Field(default_factory=single_zero)  # φ_i, a number or one an order [rad]
    angle: Annotated[str, one_of("joint", "motor")] = "joint"

    def check(self, robot: Robot) -> None:
        super().check(robot)
        for key in ("amplitude", "phase"):
            count = len(getattr(self, key))
            if count not in (1, len(self.order)):
                raise self.refused(
                    key, f"holds {count} numbers, order {len(self.order)}; give one each, or one for all"
                )
        if self.angle == "motor" and self.joint_of(robot).gear_ratio is None:
            raise self.refused("angle", "is motor, but the robot file states no gear_ratio for this joint; state it")

    def sine_and_slope(self, robot: Robot) -> tuple[Callable[[float], float], Callable[[float], float]]:
        ratio = (self.joint_of(robot).gear_ratio or 1.0) if self.angle == "motor" else 1.0
        count = len(self.order)
        amplitude, phase = (value * count if len(value) == 1 else value for value in (self.amplitude, self.phase))
        parts = [(a, ratio * k, p) for a, k, p in zip(amplitude, self.order, phase, strict=True)]
        return (
            lambda q: sum(a * math.sin(k * q + p) for a, k, p in parts),
            lambda q: sum(a * k * math.cos(k * q + p) for a, k, p in parts),
        )


class Cogging(AngleHarmonics, JointLaw):
    """τ = Σ a_i sin(k_i q' + φ_i). `amplitude`: a_i [Nm or N], `phase`: φ_i [rad]: a number, or one an order."""

    effect_id: ClassVar[str] = "cogging"

    def law(self, robot: Robot) -> Law:
        sine, slope = self.sine_and_slope(robot)
        return (lambda q, v: sine(q)), (lambda q, v: (slope(q), 0.0))


class TorqueRipple(AngleHarmonics):
    """τ = L Σ a_i sin(k_i q' + φ_i). `amplitude`: a_i [Nm/Nm], `phase`: φ_i [rad]: a number, or one an order."""

    effect_id: ClassVar[str] = "torque_ripple"

    def check(self, robot: Robot) -> None:
        super().check(robot)
        repeats = len(self.order) if len(self.amplitude) == 1 else 1
        total = repeats * sum(abs(amplitude) for amplitude in self.amplitude)
        if total > LARGEST_GAIN:
            raise self.refused("amplitude", f"adds up to {total:g} of the load; make it at most {LARGEST_GAIN:g}")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_Ripple(self.index, coordinates.motor(self.index), *self.sine_and_slope(robot)),)


class _Ripple(Term):
    depends_on_load = True

    def __init__(self, joint: int, place: int, sine: Callable[[float], float], slope: Callable[[float], float]) -> None:
        self._joint, self._place, self._sine, self._slope = joint, place, sine, slope

    def act(self, moment: Moment, forces: Forces) -> None:
        forces.load_gain[self._joint] += self._sine(moment.position[self._place])

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        place = self._place
        slopes.by_position[place, place] += moment.load[self._joint] * self._slope(moment.position[place])


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
