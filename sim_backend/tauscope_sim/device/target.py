"""Where the position loop shall be at each tick: on the host's motion, or coming to rest after a stop.

The host's feed-forward torque goes through the same spline as its positions. As steps, or at another delay than the
positions that it belongs to, it would make the drive's torque ripple in step with the host's cycle.
"""

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.device.setpoint_spline import SetpointSpline

Array = NDArray[np.float64]

STOP_TIME_S = 0.1
"""A hold brings every joint to rest in this time, all at once and so on the path that the arm is on [s]."""

DEFAULT_ACCELERATION = 20.0
"""With which a target catches up with setpoints that leapt, where the robot file states no limit [rad/s² or m/s²]."""

ROOM = 2.0
"""Multiple of the robot file's acceleration that setpoints may have without counting as a leap."""

_ROUNDING = 1e-9
_LEAP = 0.02


def catching_up_acceleration(robot: Robot) -> Array:
    """Acceleration with which each joint catches up, (n,): an arm that runs out of torque on the way overshoots."""
    stated = [joint.limits.acceleration for joint in robot.joints]
    return np.array([DEFAULT_ACCELERATION if limit is None else ROOM * limit for limit in stated])


class Target:
    """Position, velocity and feed-forward torque of the target.

    It stays within the range and below the speed limit, whatever the host asks.

    Setpoints that move within the limits are followed exactly. One that leaps is approached with bounded acceleration.

    `position`: (n,), where it begins [rad or m].
    `velocity`: (n,), how it moves there; zero for an arm at rest [rad/s or m/s].
    `acceleration`: (n,), with which it catches up with setpoints that leapt [rad/s² or m/s²].
    `tick_s`: time between two ticks [s].
    `period`: time between setpoints, where the host has told it [ticks].
    """

    def __init__(
        self, position: Array, velocity: Array, acceleration: Array, tick_s: float, period: float | None = None
    ) -> None:
        count = len(position)
        self.position = position.copy()
        self.velocity = velocity.copy()
        self.feed_forward = np.zeros(count)
        self._tick_s = tick_s
        self._low, self._high = np.full(count, -np.inf), np.full(count, np.inf)
        self._fastest = np.full(count, np.inf)
        self._acceleration = acceleration
        self._period = period
        self.resume()
        self.brake()

    def resume(self) -> None:
        """Be ready for setpoints that begin where the target is."""
        self.feed_forward = np.zeros_like(self.position)
        self._spline = SetpointSpline(self._resting_point(), self._period)
        self._asked = self.position
        self._behind = False

    def limit(self, low: Array, high: Array, fastest: Array) -> None:
        """Keep the target within limits from now on; a target that is outside the range may stay where it is.

        `low`, `high`: (n,), range [rad or m]; `fastest`: (n,), speed limit [rad/s or m/s].
        """
        self._low, self._high = np.minimum(low, self.position), np.maximum(high, self.position)
        self._fastest = fastest

    @property
    def range(self) -> tuple[Array, Array]:
        """Lower and upper end of the range, each (n,) [rad or m]."""
        return self._low, self._high

    def follow(self, position: Array, feed_forward: Array | None, arrival: float) -> None:
        """Take a setpoint of the host.

        `position`: (n,), as the host asks [rad or m]; `feed_forward`: (n,), torque that belongs to it; None for none
        [Nm or N]; `arrival`: when it arrived [ticks].
        """
        if self._braking:
            self._spline.restart(self._resting_point())
            self._asked = self.position
            self._braking, self._behind = False, True
        within = np.minimum(np.maximum(position, self._low), self._high)
        torque = np.zeros_like(within) if feed_forward is None else feed_forward
        self._spline.add(np.concatenate([within, torque]), arrival)

    def brake(self) -> None:
        """Come to rest from the present velocity within `STOP_TIME_S`."""
        self._braking = True
        self._slowing = self.velocity * (self._tick_s / STOP_TIME_S)
        self._ticks_left = round(STOP_TIME_S / self._tick_s) if self.velocity.any() else 0

    def advance(self, tick: int) -> None:
        """Move on by one tick."""
        if not self._braking and self._spline.starved(tick):
            self.brake()
        if not self._braking:
            self._follow_spline(tick)
        elif self._ticks_left > 0:
            self._ticks_left -= 1
            self.velocity = self.velocity - self._slowing if self._ticks_left else np.zeros_like(self.velocity)
            moved = self.position + self.velocity * self._tick_s
            self.position = np.minimum(np.maximum(moved, self._low), self._high)

    def _follow_spline(self, tick: int) -> None:
        """Move with the spline; catch up with it where a limit kept the target behind."""
        point, point_rate = self._spline.at(tick)
        count = len(self.position)
        position, rate, self.feed_forward = point[:count], point_rate[:count], point[count:]
        moved = (position - self._asked) / self._tick_s
        slack = self._acceleration * self._tick_s
        velocity = rate / self._tick_s
        if (
            self._behind
            or (np.abs(moved) > self._fastest).any()
            or (np.abs(moved - self.velocity) > slack + _LEAP).any()
        ):
            velocity = self._catching_up(moved, slack)
            self.position = self.position + velocity * self._tick_s
            self._behind = bool((np.abs(position - self.position) > _ROUNDING).any())
        else:
            self.position = position
        self._asked, self.velocity = position, velocity
        self.position = np.minimum(np.maximum(self.position, self._low), self._high)

    def _catching_up(self, moved: Array, slack: Array) -> Array:
        """Velocity that closes the gap to the spline, and can still be taken back in time."""
        gap = self._asked - self.position
        closing = np.minimum(np.abs(gap) / self._tick_s, np.sqrt(2.0 * self._acceleration * np.abs(gap)))
        wanted = moved + np.copysign(closing, gap)
        wanted = np.minimum(np.maximum(wanted, self.velocity - slack), self.velocity + slack)
        return np.minimum(np.maximum(wanted, -self._fastest), self._fastest)

    def _resting_point(self) -> Array:
        """Control point of the spline where the target is now, (2 n,)."""
        return np.concatenate([self.position, self.feed_forward])
