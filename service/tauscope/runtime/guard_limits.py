"""What the guard holds an arm to, one number a joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.robot import JointType, Robot
from tauscope.trajectory.limits import motion_limits
from tauscope_drivers import DriveLimits

Array = NDArray[np.float64]

DEFAULT_FOLLOWING = {JointType.REVOLUTE: 0.2, JointType.PRISMATIC: 0.05}
"""Following error that is allowed where nothing is stated [rad or m]."""

DEFAULT_MARGIN = {JointType.REVOLUTE: 0.05, JointType.PRISMATIC: 0.01}
"""How far outside the position limits the arm itself, not a command, may be found [rad or m]."""

SPEED_MARGIN = 1.5
"""Measured speed may be this many times the limit: a drive's velocity is noisy where it comes from its encoder."""

_ROOM = 1.05


@dataclass(frozen=True, eq=False)
class GuardLimits:
    """Limits of every joint; infinite where there is none.

    position_low, position_high : (n,) float64
        range of the targets [rad or m]
    velocity : (n,) float64
        largest speed of the targets [rad/s or m/s]
    acceleration : (n,) float64
        deceleration on which braking can count [rad/s² or m/s²]
    torque : (n,) float64
        largest commanded torque [Nm or N]
    following : (n,) float64
        largest distance between target and arm [rad or m]
    position_margin : (n,) float64
        how far outside the range the arm itself may be found [rad or m]
    temperature_c : float
        hottest motor [°C]
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    position_low: Array
    position_high: Array
    velocity: Array
    acceleration: Array
    torque: Array
    following: Array
    position_margin: Array
    temperature_c: float = 80.0

    @property
    def drive_limits(self) -> DriveLimits:
        """What the drives enforce: the same, with the room that the arm itself is given."""
        return DriveLimits(
            position_low=self.position_low - self.position_margin,
            position_high=self.position_high + self.position_margin,
            velocity=SPEED_MARGIN * self.velocity,
            torque=self.torque.copy(),
        )


def guard_limits(
    robot: Robot,
    low: Array,
    high: Array,
    speed: Array,
    *,
    following: float | None = None,
    temperature_c: float = 80.0,
) -> GuardLimits:
    """The limits of a run: the robot file's where it states them, else a careful default or what the motion needs.

    Parameters
    ----------
    low, high : (n,) float64
        range of the motion's positions [rad or m]
    speed : (n,) float64
        the motion's largest speed [rad/s or m/s]
    following : float or None
        following error allowed at every joint; the defaults where None [rad or m]
    temperature_c : float
        hottest motor [°C]
    """
    limits, joints = motion_limits(robot), robot.joints
    has_range = np.array([joint.limits.position is not None for joint in joints])
    has_speed = np.array([joint.limits.velocity is not None for joint in joints])
    has_acceleration = np.array([joint.limits.acceleration is not None for joint in joints])
    room = np.array([DEFAULT_MARGIN[joint.type] for joint in joints])
    return GuardLimits(
        joints=tuple(joint.name for joint in joints),
        units=tuple("rad" if joint.type is JointType.REVOLUTE else "m" for joint in joints),
        position_low=np.where(has_range, limits.position_low, np.minimum(limits.position_low, low - room)),
        position_high=np.where(has_range, limits.position_high, np.maximum(limits.position_high, high + room)),
        velocity=np.where(has_speed, limits.velocity, np.maximum(limits.velocity, _ROOM * speed)),
        acceleration=np.where(has_acceleration, limits.acceleration, np.inf),
        torque=limits.torque,
        following=np.array([DEFAULT_FOLLOWING[joint.type] if following is None else following for joint in joints]),
        position_margin=room,
        temperature_c=temperature_c,
    )
