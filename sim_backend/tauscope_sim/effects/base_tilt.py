"""Gravity direction in the base frame wrong: the real gravity is R_x(α) R_y(β) g, with small angles α, β [rad]."""

from dataclasses import replace
from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.placement import rotation_about_x, rotation_about_y
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import Effect


class BaseTilt(Effect):
    """g → R_x(α) R_y(β) g.

    about_x : float
        α [rad]
    about_y : float
        β [rad]
    """

    effect_id: ClassVar[str] = "base_tilt"
    about_x: Number = 0.0
    about_y: Number = 0.0

    def check(self, robot: Robot) -> None:
        """Refuse a base that is not tilted."""
        super().check(robot)
        if self.about_x == 0.0 and self.about_y == 0.0:
            raise self.refused("about_x", "and about_y are zero; state one of them [rad]")

    def alter(self, robot: Robot) -> Robot:
        """The arm on its tilted base."""
        turned = rotation_about_x(self.about_x) @ rotation_about_y(self.about_y) @ robot.gravity
        return replace(robot, gravity=turned)
