"""Effects that are a torque law τ(q, v) of one joint."""

from collections.abc import Callable
from enum import StrEnum
from typing import ClassVar

from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import JointEffect, SmoothSignEffect
from tauscope_sim.plant.coordinates import Coordinates
from tauscope_sim.plant.term import Forces, Moment, Slopes, Term

Law = tuple[Callable[[float, float], float], Callable[[float, float], tuple[float, float]]]
"""τ(q, v) [Nm or N], and its derivatives with respect to q and v."""


class Side(StrEnum):
    """Where in the joint a torque acts."""

    FRICTION = "friction"
    """on the motor's side, as friction that heats the joint"""
    MOTOR = "motor"
    """on the motor's side"""
    LINK = "link"
    """on the link's side: part of the load that the transmission carries"""


class JointLaw(JointEffect):
    """An effect τ(q, v) of one joint; q and v are the motor's, or the link's where it acts on that side.

    `joint`: its number, counted from 1.
    """

    side: ClassVar[Side] = Side.MOTOR

    def law(self, robot: Robot) -> Law:
        """τ(q, v) and its derivatives."""
        raise NotImplementedError

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        """The law as a term of the equations of motion."""
        place = self.index if self.side is Side.LINK else coordinates.motor(self.index)
        return (_LawTerm(self.index, place, self.side, self.law(robot)),)


class FrictionLaw(SmoothSignEffect, JointLaw):
    """A friction law τ(q, v) of one joint that uses A(v).

    `joint`: its number, counted from 1.
    `k_v`: K_v; that of the joint's friction_shape where None [s/rad or s/m].
    """

    side: ClassVar[Side] = Side.FRICTION


class _LawTerm(Term):
    """A law at its place."""

    def __init__(self, joint: int, place: int, side: Side, law: Law) -> None:
        self._joint, self._place, self._side = joint, place, side.value
        self._torque, self._slopes = law

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add τ(q, v)."""
        torque = self._torque(moment.position[self._place], moment.velocity[self._place])
        getattr(forces, self._side)[self._joint] += torque

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add dτ/dq and dτ/dv."""
        place = self._place
        by_position, by_velocity = self._slopes(moment.position[place], moment.velocity[place])
        slopes.by_position[place, place] += by_position
        slopes.by_velocity[place, place] += by_velocity
