"""Faults of the simulated drives: their words, and those that a test makes happen."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Array
from tauscope_drivers import Fault


class FaultCode(StrEnum):
    """What the simulated drives report."""

    WATCHDOG = "watchdog"
    OVER_TEMPERATURE = "over-temperature"
    OVERLOAD = "overload"
    OVER_SPEED = "over-speed"
    POSITION_LIMIT = "position-limit"
    UNSTABLE = "simulation-unstable"


# what the user does next, by fault
REMEDIES = {
    FaultCode.WATCHDOG: "find out why the host fell silent, then acknowledge the fault and enable again",
    FaultCode.OVER_TEMPERATURE: "let the motor cool down, then acknowledge the fault",
    FaultCode.OVERLOAD: "take the load off or slow the motion down, then acknowledge the fault",
    FaultCode.OVER_SPEED: "command less torque or raise the speed limit, then acknowledge the fault",
    FaultCode.POSITION_LIMIT: "command torque that turns the joint back in time, then acknowledge the fault",
    FaultCode.UNSTABLE: "make the scenario less extreme; the simulated arm was put to rest",
}


class Disturbance(StrEnum):
    """What a test can make happen to a joint."""

    LOST_SAMPLE = "lost-sample"  # the joint does not answer: its readings are missing
    OVER_TEMPERATURE = "over-temperature"  # the motor's temperature rises by the size [K]
    OVERLOAD = "overload"  # the drive reports an overload
    ENCODER_JUMP = "encoder-jump"
    """The encoder slips by the size [rad or m], for the drive's own loop too, and stays so."""


@dataclass(frozen=True)
class Injection:
    """One disturbance, for tests of what stands above the device."""

    kind: Disturbance
    joint: int  # joint number, counted from 1
    start_ns: int = 0  # device time at which it begins; one that has passed means now [ns]
    duration_ns: int | None = None  # how long it lasts; None for ever [ns]
    size: float = 0.0  # rise of the temperature or slip of the encoder [K; rad or m]

    @property
    def end_ns(self) -> float:
        """Device time at which it ends; infinite where it never does [ns]."""
        return math.inf if self.duration_ns is None else self.start_ns + self.duration_ns


def device_fault(code: FaultCode, joint: int | None, detail: str) -> Fault:
    """The fault as the protocol of `drivers` states it. `joint`: counted from 1; None for the whole arm."""
    return Fault(code.value, joint, detail, REMEDIES[code])


class FaultLatch:
    """Faults that stay until the operator acknowledges them; the first report of a kind and joint is kept."""

    def __init__(self) -> None:
        self._faults: dict[tuple[str, int | None], Fault] = {}
        self.faults: tuple[Fault, ...] = ()

    def latch(self, fault: Fault) -> None:
        """Keep a fault."""
        self._faults.setdefault((fault.code, fault.joint), fault)
        self.faults = tuple(self._faults.values())

    def clear(self) -> None:
        """Forget them all."""
        self._faults.clear()
        self.faults = ()


class Disturbances:
    """What acts now."""

    def __init__(self, joint_count: int) -> None:
        self.slip: Array = np.zeros(joint_count)  # slip of the encoders so far [rad or m]
        self.heat: Array = np.zeros(joint_count)  # rise of the motors' temperature [K]
        self.lost: NDArray[np.bool_] = np.zeros(joint_count, dtype=np.bool_)  # joints that do not answer
        self.overloaded: NDArray[np.bool_] = np.zeros(joint_count, dtype=np.bool_)
        """joints whose drive reports an overload"""
        self.any = False  # whether anything was ever injected
        self._injections: list[Injection] = []

    @property
    def waiting(self) -> bool:
        """Whether there is anything that begins or ends yet."""
        return bool(self._injections)

    def add(self, injection: Injection) -> None:
        """Take note of a disturbance."""
        self.any = True
        self._injections.append(injection)

    def update(self, time_ns: int) -> None:
        """Renew what acts at an instant."""
        if not self._injections:
            return
        for values in (self.heat, self.lost, self.overloaded):
            values[:] = 0
        for injection in [one for one in self._injections if one.start_ns <= time_ns < one.end_ns]:
            joint = injection.joint - 1
            if injection.kind is Disturbance.ENCODER_JUMP:
                self.slip[joint] += injection.size
                self._injections.remove(injection)
            elif injection.kind is Disturbance.OVER_TEMPERATURE:
                self.heat[joint] += injection.size
            elif injection.kind is Disturbance.LOST_SAMPLE:
                self.lost[joint] = True
            else:
                self.overloaded[joint] = True
        self._injections = [one for one in self._injections if time_ns < one.end_ns]
