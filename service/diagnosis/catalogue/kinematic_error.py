"""A link frame that is not where the robot file has it: a wrong length.

The base parameters take nearly all of it: what is left of a few millimetres is a ten-thousandth of its torque.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.dynamics import inverse_dynamics
from service.recording.recording import Array
from service.robot import Placement, Robot

STEP_M = 1e-3
"""Displacement of a frame for the difference quotient [m]: torque is quadratic in it, and central differences exact."""


class KinematicError(Effect):
    """τ = Σ_k ∂τ/∂d_k d_k: the frame of link j lies d farther, in the axes before its last turn."""

    id: ClassVar[str] = "kinematic_error"
    equation: ClassVar[str] = "tau = dtau/dd d, d the displacement of one link's frame"
    meaning: ClassVar[str] = "a link length or frame is wrong"
    remedy: ClassVar[str] = "measure the arm's geometry: torque hardly shows it"
    revealing_motion: ClassVar[str] = "none: measure the tool's place in several postures instead"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (
        Coefficient("d_x", "m"),
        Coefficient("d_y", "m"),
        Coefficient("d_z", "m"),
    )
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("link", "1", fixed=True),)
    least_share: ClassVar[float] = 0.01
    doubtful: ClassVar[bool] = True

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One for the arm; links are its shapes, the last one left out: what it carries hangs at its own frame.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        links = np.arange(1.0, setting.robot.joint_count)[:, None]
        return [cls(None, links, links[0], links[-1])] if len(links) else []

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque per metre along the three axes, (g, 3, n, N).

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            number of the link, from 1
        """
        state = [np.ascontiguousarray(each.T) for each in (signals.position, signals.velocity, signals.acceleration)]
        found = []
        for (number,) in shapes:
            rows = []
            for axis in np.eye(3):
                ahead, behind = (
                    inverse_dynamics(
                        displaced(signals.robot, int(number) - 1, sign * STEP_M * axis), signals.links, *state
                    )
                    for sign in (1.0, -1.0)
                )
                rows.append((ahead - behind).T / (2.0 * STEP_M))
            found.append(rows)
        return np.array(found)


def displaced(robot: Robot, link: int, by: Array) -> Robot:
    """The arm with the frame of one link, and all that follows, displaced.

    Parameters
    ----------
    robot : Robot
        the arm
    link : int
        index of the link, from 0
    by : (3,) float64
        displacement in the moved joint's frame [m]
    """
    segment = robot.segments[link]
    after = Placement(segment.after.rotation, segment.after.translation + by)
    segments = (*robot.segments[:link], replace(segment, after=after), *robot.segments[link + 1 :])
    return replace(robot, segments=segments)
