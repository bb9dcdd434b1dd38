"""Geometry that the model has wrong: a tilted base, and joints that do not turn as their encoders say."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from tauscope.robot.document_fields import Number, Vector
from tauscope.robot.kinematics import rotation_about
from tauscope.robot.robot import Placement, Robot
from tauscope_sim.effects.effect import Effect, JointNumber


class BaseTilt(Effect):
    """g → R_x(α) R_y(β) g."""

    effect_id: ClassVar[str] = "base_tilt"
    about_x: Number = 0.0  # α [rad]
    about_y: Number = 0.0  # β [rad]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.about_x == 0.0 and self.about_y == 0.0:
            raise self.refused("about_x", "and about_y are zero; state one of them [rad]")

    def alter(self, robot: Robot) -> Robot:
        turned = rotation_about(0, self.about_x) @ rotation_about(1, self.about_y) @ robot.gravity
        return replace(robot, gravity=turned)


class KinematicError(Effect):
    """A displaced link frame."""

    effect_id: ClassVar[str] = "kinematic_error"
    link: JointNumber  # j, counted from 1
    translation: Vector = Field(default=[0.0, 0.0, 0.0])  # d [m]
    rotation: Vector = Field(default=[0.0, 0.0, 0.0])  # r [rad]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if not any(self.translation) and not any(self.rotation):
            raise self.refused("translation", "and rotation are zero; state one of them")

    def alter(self, robot: Robot) -> Robot:
        index = self.link - 1
        segment = robot.segments[index]
        rotation = Rotation.from_rotvec(self.rotation).as_matrix() @ segment.after.rotation
        after = Placement(rotation, segment.after.translation + np.array(self.translation))
        segments = (*robot.segments[:index], replace(segment, after=after), *robot.segments[index + 1 :])
        return replace(robot, segments=segments)
