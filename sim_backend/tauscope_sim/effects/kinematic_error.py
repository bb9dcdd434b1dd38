"""A link length or frame wrong: the real link frame j is displaced from where the robot file has it.

In the moved joint frame (z along the axis; x is the axis of DH's a) the link frame, and all that follows, is shifted by
d [m] and turned by the rotation vector r [rad]: after → (exp[r] R, p + d). The link's inertia moves with its frame.
"""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from tauscope.robot.document_fields import Vector
from tauscope.robot.robot import Placement, Robot
from tauscope_sim.effects.effect import Effect
from tauscope_sim.effects.fields import JointNumber, zero_vector


class KinematicError(Effect):
    """A displaced link frame.

    link : int
        j, counted from 1
    translation : list of float
        d [m]
    rotation : list of float
        r [rad]
    """

    effect_id: ClassVar[str] = "kinematic_error"
    link: JointNumber
    translation: Vector = Field(default_factory=zero_vector)
    rotation: Vector = Field(default_factory=zero_vector)

    def check(self, robot: Robot) -> None:
        """Refuse a link that does not exist and an error of nothing."""
        super().check(robot)
        if self.link > robot.joint_count:
            raise self.refused("link", f"is {self.link}, but the arm has {robot.joint_count} links")
        if not any(self.translation) and not any(self.rotation):
            raise self.refused("translation", "and rotation are zero; state one of them")

    def alter(self, robot: Robot) -> Robot:
        """The arm as it was built."""
        index = self.link - 1
        segment = robot.segments[index]
        rotation = Rotation.from_rotvec(self.rotation).as_matrix() @ segment.after.rotation
        after = Placement(rotation, segment.after.translation + np.array(self.translation))
        segments = (*robot.segments[:index], replace(segment, after=after), *robot.segments[index + 1 :])
        return replace(robot, segments=segments)
