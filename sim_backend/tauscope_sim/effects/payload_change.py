"""Mass picked up or dropped during the recording: the body of `Payload`, at the tool from one instant to another [s].

The arm takes the body over at its own speed, as a gripper that follows a conveyor does: no impact, velocities go on.
"""

from typing import ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.payload import Payload
from tauscope_sim.plant.coordinates import Coordinates
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import Term


class PayloadChange(Payload):
    """A body at the last link while start ≤ t < end.

    mass : float
        m [kg]
    offset : list of float
        r [m]
    moments : list of float
        diagonal of I [kg m²]
    start : float
        when it is picked up; zero or less: it is there from the beginning [s]
    end : float or None
        when it is dropped; never where None [s]
    """

    effect_id: ClassVar[str] = "payload_change"
    start: Number = 0.0
    end: Positive | None = None

    def check(self, robot: Robot) -> None:
        """Refuse a payload that never changes."""
        super().check(robot)
        if self.end is None and self.start <= 0.0:
            raise self.refused("start", "is missing: without start and end nothing changes; state one, or use payload")
        if self.end is not None and self.end <= self.start:
            raise self.refused("end", f"is {self.end:g} s, not after start ({self.start:g} s); state a later instant")

    def alter(self, robot: Robot) -> Robot:
        """The arm itself: the body comes later."""
        return robot

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        """The changes."""
        return (_Change(self),)


class _Change(Term):
    """Picks up and drops."""

    def __init__(self, change: PayloadChange) -> None:
        self._payload = change.standard_parameters()
        self._start, self._end = change.start, change.end
        self.event_times = (change.start,) if change.end is None else (change.start, change.end)

    def begin(self, time: float, bodies: RigidBodies) -> None:
        """Carry the body, or not."""
        present = self._start <= time and (self._end is None or time < self._end)
        bodies.carry(self, self._payload if present else None)
