"""Where the position loop shall be at each tick: on the host's motion, or coming to rest after a stop.

The host's feed-forward torque goes through the same spline as its positions. As steps, or at another delay than the
positions that it belongs to, it would make the drive's torque ripple in step with the host's cycle.
"""

from collections import deque
from statistics import median_low

import numpy as np

from tauscope.robot.robot import Array, Robot

_LATEST_PHASE = 5.0
_CURVED_CYCLES = 2.0
_MOST_SKIPPED = 10
_EARLIEST = 0.3
_EARLY, _LATE = 0.5, 1.9
_LARGEST_ERROR = 0.1
_MEMORY = 200
_INTERVALS = 15
_CHANGE_OF_PACE = 0.1
_FIRST_PERIOD = 4.0
_TOLD = 20  # a grid whose period was told begins as one that rests on so many arrivals

# after so many arrivals in a row that are off the grid on the same side, it is the grid that is wrong
_OFF_THE_GRID = 15


class SetpointSpline:
    """Target as a function of the drive's own time, from setpoints that arrive roughly periodically.

    A setpoint is a point of any kind: joint positions, and what else belongs to the same instant of the motion.

    The drive has no clock in common with the host. Its grid of cycles is a straight line through the last arrivals,
    with a memory long enough to keep their jitter out of the target; it begins anew where the host changes its pace.
    While a setpoint is overdue the target goes on as it moved; cycles that the host skipped are filled in on a
    parabola. Time is counted in ticks.

    `position`: (n,), where the target stands [rad or m].
    `period`: time between setpoints, where the host has told it: a drive that knows it does not have to find it
        [ticks].
    """

    def __init__(self, position: Array, period: float | None = None) -> None:
        self._points = np.tile(position, (4, 1))
        self._intervals: deque[float] = deque(maxlen=_INTERVALS)
        self._is_told = period is not None
        self._period = _FIRST_PERIOD if period is None else period
        self._arrival: float | None = None
        self._grid = 0.0
        self._arrivals = 0
        self._off = 0
        self._weights = np.empty((2, 4))

    def add(self, position: Array, arrival: float) -> None:
        """Take a setpoint. `position`: (n,), target of the host [rad or m]; `arrival`: when it arrived [ticks]."""
        cycles = self._place_on_grid(arrival)
        older, before = self._points[2].copy(), self._points[3].copy()
        # parabola through the last two setpoints, at -1 and 0, and the new one
        bend = ((position - before) / max(cycles, 1) - (before - older)) / (cycles + 1.0)
        slope = (before - older) + bend
        for cycle in range(1, cycles + 1):
            self._points[:3] = self._points[1:]
            self._points[3] = before + cycle * slope + (cycle * cycle) * bend
        self._points[3] = position

    def is_starved(self, time: float) -> bool:
        """Whether setpoints have failed to come for so long that the target should come to rest. `time`: [ticks]."""
        return time - self._grid > _LATEST_PHASE * self._period

    def restart(self, position: Array) -> None:
        """Go on with setpoints from `position`, (n,) [rad or m]; the pace of the host is not forgotten."""
        self._points[:] = position

    def at(self, time: float) -> tuple[Array, Array]:
        """Target [rad or m] and its rate [per tick] at an instant [ticks] not long before the last setpoint, (n,)."""
        overdue = (time - self._grid) / self._period
        rate = 1.0 / self._period
        x = min(max(overdue, -1.0), 1.0)
        x2 = x * x
        x3 = x2 * x
        self._weights[:] = (
            (
                (1.0 - 3.0 * x + 3.0 * x2 - x3) / 6.0,
                (4.0 - 6.0 * x2 + 3.0 * x3) / 6.0,
                (1.0 + 3.0 * x + 3.0 * x2 - 3.0 * x3) / 6.0,
                x3 / 6.0,
            ),
            (
                rate * (-0.5 + x - 0.5 * x2),
                rate * (-2.0 * x + 1.5 * x2),
                rate * (0.5 + x - 1.5 * x2),
                rate * (0.5 * x2),
            ),
        )
        position, velocity = self._weights.dot(self._points)
        return self._overdue(position, velocity, overdue - 1.0) if overdue > 1.0 else (position, velocity)

    def _overdue(self, position: Array, velocity: Array, cycles: float) -> tuple[Array, Array]:
        """Go on from the end of the spline: with its acceleration at first, then with the velocity reached."""
        points = self._points
        change = points[1] - 2.0 * points[2] + points[3]
        curved = min(cycles, _CURVED_CYCLES)
        position += (cycles * self._period) * velocity + (curved * (cycles - 0.5 * curved)) * change
        return position, velocity + (curved / self._period) * change

    def _place_on_grid(self, arrival: float) -> int:
        """Find the cycle that a setpoint belongs to; returns by how many it follows the one before, zero where none."""
        before, self._arrival = self._arrival, arrival
        if before is None:
            return self._begin_grid(arrival)
        self._intervals.append(max(arrival - before, 0.0))
        usual = max(1.0, median_low(self._intervals))
        learning = len(self._intervals) < _INTERVALS and not self._is_told
        if not learning and not self._is_told and abs(usual - self._period) > _CHANGE_OF_PACE * self._period:
            self._period = usual
            self._intervals.clear()
            return self._begin_grid(arrival)
        unit = usual if learning else self._period
        cycles = self._cycles((arrival - self._grid) / unit)
        if cycles > _MOST_SKIPPED or abs(self._off) >= _OFF_THE_GRID:
            return self._begin_grid(arrival)
        self._lock(arrival, cycles, learning)
        return cycles

    def _cycles(self, waited: float) -> int:
        """How many cycles passed while so many were waited for: a host that tells its period skips whole ones."""
        if self._is_told and _EARLY < waited < _LATE:
            return 1
        return max(int(waited + _EARLIEST), 0)

    def _begin_grid(self, arrival: float) -> int:
        self._grid, self._arrivals, self._off = arrival, _TOLD if self._is_told else 1, 0
        return 1

    def _lock(self, arrival: float, cycles: int, learning: bool) -> None:
        """Fit a straight line to the arrivals, by least squares with a memory of limited length.

        Its slope is the host's period, unless that was told: a few late arrivals at first would make it run away from
        those that follow.
        """
        self._arrivals = n = min(self._arrivals + 1, _MEMORY)
        self._grid += cycles * self._period
        late = arrival - self._grid
        if not learning:
            # a stall says nothing of the host's clock
            largest = _LARGEST_ERROR * self._period
            side = int(np.sign(late)) if abs(late) > largest else 0
            self._off = self._off + side if side * self._off > 0 else side
            late = min(max(late, -largest), largest)
        self._grid += 2.0 * (2 * n - 1) / (n * (n + 1)) * late
        if not self._is_told:
            self._period = max(1.0, self._period + 6.0 / (n * (n + 1)) * late / max(cycles, 1))


# a hold brings every joint to rest in this time, all at once and so on the path that the arm is on [s]
STOP_TIME_S = 0.1
# with which a target catches up with setpoints that leapt, where the robot file states no limit [rad/s² or m/s²]
DEFAULT_ACCELERATION = 20.0
ROOM = 2.0  # multiple of the robot file's acceleration that setpoints may have without counting as a leap

_ROUNDING = 1e-9
_LEAP = 0.02


def catching_up_acceleration(robot: Robot) -> Array:
    """Acceleration with which each joint catches up, (n,): an arm that runs out of torque on the way overshoots."""
    stated = [joint.limits.acceleration for joint in robot.joints]
    return np.array([DEFAULT_ACCELERATION if limit is None else ROOM * limit for limit in stated])


class Target:
    """Position, velocity and feed-forward torque of the target, which stays within range and speed limit.

    Setpoints within the limits are followed exactly; one that leaps is approached with `acceleration` [rad/s² or m/s²].
    `position`, `velocity`: (n,), where it begins and how [rad or m, and per s]; `tick_s`: of a tick [s]; `period`: of
    setpoints, where it is told [ticks].
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
        """Keep the target within `low`, `high` and `fastest`, (n,), or where it is [rad or m, and per s]."""
        self._low, self._high = np.minimum(low, self.position), np.maximum(high, self.position)
        self._fastest = fastest

    @property
    def range(self) -> tuple[Array, Array]:
        """Lower and upper end of the range, each (n,) [rad or m]."""
        return self._low, self._high

    def follow(self, position: Array, feed_forward: Array | None, arrival: float) -> None:
        """Take the host's `position` (n,) [rad or m] and its `feed_forward` [Nm or N]; `arrival`: when [ticks]."""
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
        if not self._braking and self._spline.is_starved(tick):
            self.brake()
        if not self._braking:
            self._follow_spline(tick)
        elif self._ticks_left > 0:
            self._ticks_left -= 1
            self.velocity = self.velocity - self._slowing if self._ticks_left else np.zeros_like(self.velocity)
            moved = self.position + self.velocity * self._tick_s
            self.position = np.minimum(np.maximum(moved, self._low), self._high)

    def _follow_spline(self, tick: int) -> None:
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
