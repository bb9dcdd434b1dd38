"""Friction that grows with the transmitted torque: τ = μ |L| A(v), μ without unit, A(v) = (2/π) arctan(K_v v).

L is the torque that the transmission hands to the link: rigid bodies, springs and contacts, but not the motor's own
inertia. It depends on the acceleration, which depends on the friction: `tauscope_sim.plant.term` solves that loop.
"""

from typing import ClassVar

from tauscope.robot.document_fields import Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import SmoothSignEffect
from tauscope_sim.friction import smooth_sign, smooth_sign_slope
from tauscope_sim.plant.term import LARGEST_GAIN, Coordinates, Forces, Moment, Slopes, Term


class LoadDependentFriction(SmoothSignEffect):
    """τ = μ |L| A(v)."""

    effect_id: ClassVar[str] = "load_dependent_friction"
    mu: Positive  # μ [Nm/Nm]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.mu > LARGEST_GAIN:
            raise self.refused("mu", f"is {self.mu:g}: the transmission locks itself; make it at most {LARGEST_GAIN:g}")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_LoadFriction(self.index, coordinates.motor(self.index), self.mu, self.steepness(robot)),)


class _LoadFriction(Term):
    depends_on_load = True

    def __init__(self, joint: int, place: int, mu: float, k_v: float) -> None:
        self._joint, self._place, self._mu, self._k_v = joint, place, mu, k_v

    def act(self, moment: Moment, forces: Forces) -> None:
        forces.load_friction[self._joint] += self._mu * smooth_sign(moment.velocity[self._place], self._k_v)

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        place = self._place
        slope = smooth_sign_slope(moment.velocity[place], self._k_v)
        slopes.by_velocity[place, place] += self._mu * abs(moment.load[self._joint]) * slope
