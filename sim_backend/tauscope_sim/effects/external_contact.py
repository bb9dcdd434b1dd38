"""Contact with the surroundings in a bounded time window: the tool presses with F, or one joint with a torque.

With w(t) = 1 in the window (profile ``rectangular``) or sin(π (t - t₀)/T) (``half_sine``), and J(q) the Jacobian of the
contact point:

    τ = J(q)ᵀ F w(t)       [Nm], F in N, base axes: the force that the tool exerts on the surroundings
    τ_j = c w(t)           [Nm or N], where a joint and a torque are stated instead
"""

import math
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from tauscope.robot.document_fields import Number, Positive, Vector
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import Effect, JointNumber, NotNegative, one_of
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import Coordinates, Forces, Moment, Term


class ExternalContact(Effect):
    """Force at the tool, or torque at one joint, while t₀ ≤ t < t₀ + T."""

    effect_id: ClassVar[str] = "external_contact"
    force: Vector | None = None  # F [N]
    offset: Vector = Field(default=[0.0, 0.0, 0.0])  # contact point in the last link's frame [m]
    joint: JointNumber | None = None  # joint, counted from 1
    torque: Number | None = None  # c [Nm or N]
    start: NotNegative  # t₀ [s]
    duration: Positive  # T [s]
    profile: Annotated[str, one_of("half_sine", "rectangular")] = "half_sine"

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.force is not None and (self.joint is not None or self.torque is not None):
            raise self.refused(
                "force", "stands beside joint or torque; state a force at the tool or a torque at a joint"
            )
        if self.force is None and (self.joint is None or self.torque is None):
            raise self.refused("force", "is missing; state it, or joint and torque")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_Contact(self),)


class _Contact(Term):
    def __init__(self, contact: ExternalContact) -> None:
        self._contact, self._offset = contact, np.array(contact.offset)
        self._force = None if contact.force is None else np.array(contact.force)
        self._joint, self._torque = (contact.joint or 1) - 1, contact.torque or 0.0
        self.event_times = (contact.start, contact.start + contact.duration)
        self._touching = False

    def begin(self, time: float, bodies: RigidBodies) -> None:
        self._touching = self.event_times[0] <= time < self.event_times[1]

    def act(self, moment: Moment, forces: Forces) -> None:
        if not self._touching:
            return
        contact, share = self._contact, 1.0
        if contact.profile == "half_sine":
            share = math.sin(math.pi * (moment.time - contact.start) / contact.duration)
        if self._force is None:
            forces.link[self._joint] += share * self._torque
        else:
            torque = share * (self._force @ moment.bodies.tool_jacobian(self._offset))
            forces.link = [carried + pushed for carried, pushed in zip(forces.link, torque.tolist(), strict=True)]
