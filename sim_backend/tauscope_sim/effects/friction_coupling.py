"""Friction on the sum or difference of two joints' motion, as a wrist with bevel gears has it.

With w = v_j + s v_k, s = ±1, and f = c A(w) + d w, joint j feels τ_j = f and joint k feels τ_k = s f;
c in Nm, d in Nm s/rad, A(w) = (2/π) arctan(K_v w) with the K_v of joint j.
"""

from typing import Annotated, ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import JointNumber, SmoothSignEffect, one_of
from tauscope_sim.friction import smooth_sign, smooth_sign_slope
from tauscope_sim.plant.term import Coordinates, Forces, Moment, Slopes, Term


class FrictionCoupling(SmoothSignEffect):
    """τ_j = f, τ_k = s f with f = c A(v_j + s v_k) + d (v_j + s v_k). `joint`: j, counted from 1."""

    effect_id: ClassVar[str] = "friction_coupling"
    other_joint: JointNumber  # k, counted from 1
    of: Annotated[str, one_of("sum", "difference")] = "sum"
    coulomb: Number = 0.0  # c [Nm or N]
    viscous: Number = 0.0  # d [Nm s/rad or N s/m]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.other_joint == self.joint:
            raise self.refused("other_joint", f"is {self.joint} too; name the joint that it is coupled with")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_Coupling(self, coordinates, self.steepness(robot)),)


class _Coupling(Term):
    def __init__(self, effect: FrictionCoupling, coordinates: Coordinates, k_v: float) -> None:
        self._joints = first, second = effect.index, effect.other_joint - 1
        self._places = coordinates.motor(first), coordinates.motor(second)
        self._sign = 1.0 if effect.of == "sum" else -1.0
        self._coulomb, self._viscous, self._k_v = effect.coulomb, effect.viscous, k_v

    def act(self, moment: Moment, forces: Forces) -> None:
        w = self._motion(moment)
        friction = self._coulomb * smooth_sign(w, self._k_v) + self._viscous * w
        forces.friction[self._joints[0]] += friction
        forces.friction[self._joints[1]] += self._sign * friction

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        slope = self._coulomb * smooth_sign_slope(self._motion(moment), self._k_v) + self._viscous
        first, second = self._places
        slopes.by_velocity[first, first] += slope
        slopes.by_velocity[second, second] += slope
        slopes.by_velocity[first, second] += self._sign * slope
        slopes.by_velocity[second, first] += self._sign * slope

    def _motion(self, moment: Moment) -> float:
        return moment.velocity[self._places[0]] + self._sign * moment.velocity[self._places[1]]
