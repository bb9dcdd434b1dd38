"""On which arm and in which ranges of motion effects are looked for."""

from dataclasses import dataclass

from tauscope.recording.recording import Array
from tauscope.robot import Robot

LEAST_LOAD = 0.02
"""Rms of a joint's rigid-body torque relative to its largest torque below which nothing presses its transmission."""

ONE_WAY = 0.1
"""Speed the other way, relative to the rms, below which a joint does not reverse."""


@dataclass(frozen=True, eq=False)
class Setting:
    """The arm and the ranges of its recorded motion.

    slowest, fastest : (n,) float64
        range of every joint's velocity, the rarest percents left out [rad/s or m/s]
    lowest, highest : (n,) float64
        range of every joint's position [rad or m]
    speed, top_speed : (n,) float64
        rms and largest magnitude of every joint's velocity [rad/s or m/s]
    load, top_torque : (n,) float64
        rms of the fitted rigid-body torque, largest magnitude of the model's torque [Nm or N]
    inertia : (n,) float64
        mean of every joint's inertia with all that it carries, zero where the fit knows of none [kg m² or kg]
    durations : tuple of float
        length of every training recording [s]
    cutoff_hz : float
        highest frequency that torque and columns share [Hz]
    position_std : (n,) float64 or None
        noise of every joint's position, its encoder's steps included [rad or m]; None where it is negligible
    """

    robot: Robot
    slowest: Array
    fastest: Array
    lowest: Array
    highest: Array
    speed: Array
    top_speed: Array
    load: Array
    top_torque: Array
    inertia: Array
    durations: tuple[float, ...]
    cutoff_hz: float
    position_std: Array | None = None

    @property
    def joints(self) -> range:
        """Indices of the joints that move."""
        return range(self.robot.joint_count)

    def moves(self, joint: int) -> bool:
        """Whether a joint moves at all.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        return bool(self.highest[joint] > self.lowest[joint] and self.speed[joint] > 0.0)

    def reverses(self, joint: int) -> bool:
        """Whether a joint moves both ways.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        return bool(
            self.slowest[joint] < -ONE_WAY * self.speed[joint] and self.fastest[joint] > ONE_WAY * self.speed[joint]
        )

    def is_loaded(self, joint: int) -> bool:
        """Whether the rigid body loads a joint's transmission at all.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        return bool(self.load[joint] > LEAST_LOAD * self.top_torque[joint])
