"""Unmodelled mass at the tool: a rigid body of mass m [kg] fixed to the last link.

It adds to the last link's mass m, first moment m r and inertia I + m (rᵀr 1 - r rᵀ), with r the centre's offset from
the last link frame's origin [m] and I about its own centre [kg m²], axes of the link frame.
"""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.robot.document_fields import Positive, Vector
from tauscope.robot.robot import LinkInertia, Robot
from tauscope_sim.effects.effect import Effect
from tauscope_sim.effects.fields import zero_vector

Array = NDArray[np.float64]


class Payload(Effect):
    """A body fixed to the last link.

    mass : float
        m [kg]
    offset : list of float
        r [m]
    moments : list of float
        diagonal of I [kg m²]
    """

    effect_id: ClassVar[str] = "payload"
    mass: Positive
    offset: Vector = Field(default_factory=zero_vector)
    moments: Vector = Field(default_factory=zero_vector)

    def check(self, robot: Robot) -> None:
        """Refuse moments of inertia that no body has."""
        super().check(robot)
        if min(self.moments) < 0.0 or 2.0 * max(self.moments) > sum(self.moments) * (1.0 + 1e-9):
            raise self.refused("moments", "no body has these: none may be negative or exceed the sum of the others")

    def standard_parameters(self) -> Array:
        """The body's ten standard parameters in the last link's frame, (10,)."""
        offset = np.array(self.offset)
        about_origin = np.diag(self.moments) + self.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return LinkInertia(self.mass, self.mass * offset, about_origin).to_vector()

    def alter(self, robot: Robot) -> Robot:
        """The arm with the body on its last link."""
        if robot.model.links is None:
            return robot
        *others, last = robot.model.links
        loaded = LinkInertia.from_vector(last.to_vector() + self.standard_parameters())
        return replace(robot, model=replace(robot.model, links=(*others, loaded)))
