"""Friction laws of a joint, from its velocity, position and load."""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import Exponent, FrictionLaw, JointLaw, Law, Side
from tauscope_sim.plant.term import LARGEST_GAIN


class CoulombFriction(FrictionLaw):
    """τ = c A(v)."""

    effect_id: ClassVar[str] = "coulomb_friction"
    level: Number  # c [Nm or N]

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        return self.level, 0.0, 0.0


class ViscousFriction(JointLaw):
    """τ = c v."""

    effect_id: ClassVar[str] = "viscous_friction"
    side: ClassVar[Side] = Side.FRICTION
    coefficient: Number  # c [Nm s/rad or N s/m]

    def law(self, robot: Robot) -> Law:
        return (lambda q, v: self.coefficient * v), (lambda q, v: (0.0, self.coefficient))


class StribeckFriction(FrictionLaw):
    """τ = c A(v) exp(-(|v|/v_s)^α)."""

    effect_id: ClassVar[str] = "stribeck_friction"
    amplitude: Number  # c [Nm or N]
    velocity: Positive  # v_s [rad/s or m/s]
    exponent: Exponent = 2.0

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        power = (abs(v) / self.velocity) ** self.exponent
        level = self.amplitude * math.exp(-power)
        # d exp(-x^α)/dv = -α x^α / v exp(-x^α), taken as zero at rest where A(v) vanishes too
        return level, 0.0, -level * self.exponent * power / v if v else 0.0


class AsymmetricCoulomb(FrictionLaw):
    """τ = c A(v) for v > 0, else 0."""

    effect_id: ClassVar[str] = "asymmetric_coulomb"
    amplitude: Number  # c: friction of positive motion less that of negative motion [Nm or N]

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        return self.amplitude if v > 0.0 else 0.0, 0.0, 0.0


class AsymmetricViscous(JointLaw):
    """τ = c max(v, 0)."""

    effect_id: ClassVar[str] = "asymmetric_viscous"
    side: ClassVar[Side] = Side.FRICTION
    amplitude: Number  # c: coefficient of positive motion less that of negative motion [Nm s/rad or N s/m]

    def law(self, robot: Robot) -> Law:
        return (lambda q, v: self.amplitude * max(v, 0.0), lambda q, v: (0.0, self.amplitude if v > 0.0 else 0.0))


LEAST_SPEED = 1e-3  # below this the slope of a root is taken as here: it has none at zero [rad/s or m/s]


class NonlinearViscous(JointLaw):
    """τ = c sgn(v) |v|^p."""

    effect_id: ClassVar[str] = "nonlinear_viscous"
    side: ClassVar[Side] = Side.FRICTION
    amplitude: Number  # c, friction at 1 rad/s or 1 m/s [Nm or N]
    exponent: Exponent

    def law(self, robot: Robot) -> Law:
        c, p = self.amplitude, self.exponent
        return (
            lambda q, v: math.copysign(c * abs(v) ** p, c * v),
            lambda q, v: (0.0, c * p * max(abs(v), LEAST_SPEED) ** (p - 1.0)),
        )


class PositionDependentFriction(FrictionLaw):
    """τ = c A(v) sin(k q + φ)."""

    effect_id: ClassVar[str] = "position_dependent_friction"
    amplitude: Number  # c [Nm or N]
    order: Positive = 1.0
    phase: Number = 0.0  # φ [rad]

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        angle = self.order * q + self.phase
        return self.amplitude * math.sin(angle), self.amplitude * self.order * math.cos(angle), 0.0


class LoadDependentFriction(FrictionLaw):
    """τ = μ |L| A(v), L the torque that the transmission hands to the link; see `tauscope_sim.plant.term`."""

    effect_id: ClassVar[str] = "load_dependent_friction"
    side: ClassVar[Side] = Side.LOAD_FRICTION
    mu: Positive  # μ [Nm/Nm]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.mu > LARGEST_GAIN:
            raise self.refused("mu", f"is {self.mu:g}: the transmission locks itself; make it at most {LARGEST_GAIN:g}")

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        return self.mu, 0.0, 0.0
