"""What sensors and drives make of the torque and the time: gains, limits, delays."""

from collections import deque
from collections.abc import Callable
from typing import Annotated, ClassVar, Protocol

import numpy as np

from tauscope.robot.document_fields import Nonzero, Positive
from tauscope.robot.robot import Array, Robot
from tauscope_sim.effects.effect import JointNumber, ScenarioEntry, one_of


class Channel(Protocol):
    """A sensor effect at work: it sees the samples in the order of time, and only those of the past."""

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        """What is recorded at `time` [s] in place of `position` [rad or m] and `torque` [Nm or N], (n,)."""
        ...


class SensorEffect(ScenarioEntry):
    """An effect between the arm and the recording."""

    def channel(self, joint_count: int) -> Channel:
        raise NotImplementedError


class TorqueGainError(SensorEffect):
    """τ_recorded = gain τ."""

    effect_id: ClassVar[str] = "torque_gain_error"
    joint: JointNumber
    gain: Nonzero

    def channel(self, joint_count: int) -> Channel:
        return _Recorded(self.joint - 1, lambda torque: self.gain * torque)


class _Recorded:
    """One joint's torque, recorded as something else."""

    def __init__(self, joint: int, record: Callable[[float], float]) -> None:
        self._joint, self._record = joint, record

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        recorded = torque.copy()
        recorded[self._joint] = self._record(torque[self._joint])
        return position, recorded


class TorqueSaturation(SensorEffect):
    """τ_recorded = c tanh(τ/c), or τ clipped to ±c."""

    effect_id: ClassVar[str] = "torque_saturation"
    joint: JointNumber
    level: Positive  # c [Nm or N]
    shape: Annotated[str, one_of("compression", "clip")] = "compression"

    def channel(self, joint_count: int) -> Channel:
        shrink = (lambda ratio: np.clip(ratio, -1.0, 1.0)) if self.shape == "clip" else np.tanh
        return _Recorded(self.joint - 1, lambda torque: self.level * shrink(torque / self.level))


LONGEST_DELAY = 1.0  # what is late by more is no delay of a channel [s]


class TimeDelay(SensorEffect):
    """τ_recorded(t) = τ(t - d)."""

    effect_id: ClassVar[str] = "time_delay"
    delay: Nonzero  # d, by which torque is late relative to position; negative: position is late [s]
    joint: JointNumber | None = None  # its number, counted from 1; all joints where None

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if abs(self.delay) > LONGEST_DELAY:
            raise self.refused("delay", f"is {self.delay:g} s; state at most {LONGEST_DELAY:g} s")

    def channel(self, joint_count: int) -> Channel:
        columns = slice(None) if self.joint is None else slice(self.joint - 1, self.joint)
        return _DelayLine(self.delay, columns)


class _DelayLine:
    def __init__(self, delay: float, columns: slice) -> None:
        self._delay, self._columns = delay, columns
        self._samples: deque[tuple[float, Array]] = deque()

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        late = torque if self._delay > 0.0 else position
        recorded = late.copy()
        recorded[self._columns] = self._past(time, late[self._columns], abs(self._delay))
        return (position, recorded) if self._delay > 0.0 else (recorded, torque)

    def _past(self, time: float, value: Array, age: float) -> Array:
        samples, instant = self._samples, time - age
        samples.append((time, value.copy()))
        while len(samples) > 1 and samples[1][0] <= instant:
            samples.popleft()
        (before, old), (after, new) = samples[0], samples[min(1, len(samples) - 1)]
        if instant <= before or after == before:
            return old
        return old + (instant - before) / (after - before) * (new - old)
