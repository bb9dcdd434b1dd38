"""How fast a servo goes after each goal: so that it is still under way when the next one comes.

Goals come in steps, one a cycle. A servo that leaps to each of them exerts a current that jumps with the goal and falls
until the next. It is read once a cycle, always at the same moment of that rise and fall: what is read is not the mean,
and differs from it in proportion to speed, which looks like friction.

A goal belongs to the instant at which its cycle was due. A servo that is given the same time for it by a late host as
by one in time goes too slowly after it, and too fast after the next: its target lags by more where it is read than in
the mean, by v σ²/(4T) at speed v for lateness of variance σ² and a cycle T, and that too looks like viscous friction.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from tauscope_drivers.clock import CycleGrid

_AHEAD_CYCLES = 2.0
"""A goal is to be reached when that of the next cycle but one comes: while the host is less than a cycle late, no servo
stands still for want of a goal. It is one more cycle behind for that."""

_LEAST_CYCLES = 0.5  # a goal that comes very late is still not leapt to
_LEAST_PART = 0.01  # part of the largest speed with which even the shortest way is gone


class PacedServo(Protocol):
    """A servo whose target follows its goal at a speed that it is told."""

    @property
    def counts_per_speed_unit(self) -> float:
        """One unit of that speed [counts/s]."""
        ...


class GoalPace:
    """Speed for each goal; keeps account of where the servos' own targets are."""

    def __init__(
        self, servos: Sequence[PacedServo], goals: Sequence[int], caps: Sequence[int], cycle_s: float, now_ns: int
    ) -> None:
        """Begin with servos that hold `goals` [counts]. `caps`: largest speed of each, 0 for none [units]."""
        self._counts_per_second = [servo.counts_per_speed_unit for servo in servos]
        self._goals = list(goals)
        self._targets = [float(goal) for goal in goals]
        self._caps = [math.inf if cap == 0 else cap for cap in caps]
        self._speeds = [0] * len(goals)
        self._cycle_s = cycle_s
        self._now_ns = now_ns
        self._grid = CycleGrid(cycle_s)

    def speeds(self, goals: Sequence[int], now_ns: int) -> list[int]:
        """Speed of each servo towards its next goal [units]. `goals`: of each servo [counts]."""
        elapsed_s, self._now_ns = (now_ns - self._now_ns) * 1e-9, now_ns
        self._grid.cycles_until(now_ns)
        late_s = self._grid.late_ns(now_ns) * 1e-9
        left_s = max(_AHEAD_CYCLES * self._cycle_s - late_s, _LEAST_CYCLES * self._cycle_s)
        for joint, unit in enumerate(self._counts_per_second):
            reach = self._speeds[joint] * unit * elapsed_s
            self._targets[joint] += min(reach, max(-reach, self._goals[joint] - self._targets[joint]))
            cap = self._caps[joint]
            wanted = abs(goals[joint] - self._targets[joint]) / (left_s * unit)
            least = 1.0 if cap == math.inf else max(1.0, _LEAST_PART * cap)
            self._speeds[joint] = int(min(cap, math.ceil(max(wanted, least))))
        self._goals = list(goals)
        return list(self._speeds)
