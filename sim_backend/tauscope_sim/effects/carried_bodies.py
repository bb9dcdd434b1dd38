"""Bodies that the model lacks: a payload, from the beginning or from some time on, and rotors."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from tauscope.robot.document_fields import Number, Positive, Vector
from tauscope.robot.robot import Array, LinkInertia, Robot
from tauscope_sim.effects.effect import Effect, JointEffect
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import Coordinates, Term


class Payload(Effect):
    """A body fixed to the last link."""

    effect_id: ClassVar[str] = "payload"
    mass: Positive  # m [kg]
    offset: Vector = Field(default=[0.0, 0.0, 0.0])  # r [m]
    moments: Vector = Field(default=[0.0, 0.0, 0.0])  # diagonal of I [kg m²]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if min(self.moments) < 0.0 or 2.0 * max(self.moments) > sum(self.moments) * (1.0 + 1e-9):
            raise self.refused("moments", "no body has these: none may be negative or exceed the sum of the others")

    def standard_parameters(self) -> Array:
        """The body's ten standard parameters in the last link's frame, (10,)."""
        offset = np.array(self.offset)
        about_origin = np.diag(self.moments) + self.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return LinkInertia(self.mass, self.mass * offset, about_origin).to_vector()

    def alter(self, robot: Robot) -> Robot:
        if robot.model.links is None:
            return robot
        *others, last = robot.model.links
        loaded = LinkInertia.from_vector(last.to_vector() + self.standard_parameters())
        return replace(robot, model=replace(robot.model, links=(*others, loaded)))


class PayloadChange(Payload):
    """A body at the last link while start ≤ t < end: `mass` m [kg], `offset` r [m], `moments` diag I [kg m²]."""

    effect_id: ClassVar[str] = "payload_change"
    start: Number = 0.0  # when it is picked up; zero or less: it is there from the beginning [s]
    end: Positive | None = None  # when it is dropped; never where None [s]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.end is None and self.start <= 0.0:
            raise self.refused("start", "is missing: without start and end nothing changes; state one, or use payload")
        if self.end is not None and self.end <= self.start:
            raise self.refused("end", f"is {self.end:g} s, not after start ({self.start:g} s); state a later instant")

    def alter(self, robot: Robot) -> Robot:
        return robot

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_Change(self),)


class _Change(Term):
    def __init__(self, change: PayloadChange) -> None:
        self._payload = change.standard_parameters()
        self._start, self._end = change.start, change.end
        self.event_times = (change.start,) if change.end is None else (change.start, change.end)

    def begin(self, time: float, bodies: RigidBodies) -> None:
        present = self._start <= time and (self._end is None or time < self._end)
        bodies.carry(self, self._payload if present else None)


class RotorInertia(JointEffect):
    """τ = J q̈."""

    effect_id: ClassVar[str] = "rotor_inertia"
    inertia: Positive  # J, the rotor's inertia times the square of the gear ratio [kg m² or kg]

    def added_rotor_inertia(self, robot: Robot) -> Array:
        inertia = np.zeros(robot.joint_count)
        inertia[self.index] = self.inertia
        return inertia
