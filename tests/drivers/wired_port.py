"""A serial port whose emulated servos answer in the same thread, at once, and the start of a run on it."""

import time
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

import numpy as np
import pytest

import feetech_bus
from feetech_bus.bus import FeetechBus
from feetech_bus.servo import FeetechServo
from tauscope_drivers import Backend, ControlMode, DriverError, Setpoint, StopPolicy
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.limits import stated_limits
from tauscope_sim import dynamixel_bus

CYCLE_S = 0.01
EMULATED: dict[type, tuple[Any, Any]] = {
    dynamixel_bus.ServoSpecification: (dynamixel_bus.EmulatedServo, dynamixel_bus.EmulatedBus),
    feetech_bus.ServoSpecification: (FeetechServo, FeetechBus),
}


class WiredPort:
    """Stands in for `SerialPort`; the servos are those that were wired last."""

    latency_s = 0.001
    wired: ClassVar[Any]

    def __init__(self, path: str, baud: int, slack_s: float = 0.002) -> None:
        self.path, self.baudrate = path, baud
        self._come = b""

    @classmethod
    def wire(cls, servos: Iterable[tuple[Any, float]], **options: Any) -> list[Any]:
        """Connect servos, each of which stands at a place [rad]."""
        made, kinds = [], EMULATED[feetech_bus.ServoSpecification]
        for specification, place in servos:
            kinds = EMULATED[type(specification)]
            servo = kinds[0](specification)
            servo.take_motion(place, 0.0, 0.0)
            servo.sense(0.0)
            made.append(servo)
        cls.wired = kinds[1](made, paced=False, **options)
        return made

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass

    def send(self, frame: bytes) -> None:
        now = time.monotonic()
        self._come = b"".join(data for _, data in self.wired.answer(self.wired.hear(frame, now), now))

    def receive(self, deadline_ns: int) -> bytes:
        come, self._come = self._come, b""
        return come

    def drain(self) -> None:
        self._come = b""

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        return time.monotonic_ns()


def wire_drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let arms and doctor use the wired servos."""
    for module in ("arm", "doctor"):
        monkeypatch.setattr(f"tauscope_drivers.serial_servos.{module}.SerialPort", WiredPort)


def starts(arm: Backend, joints: Sequence[DriveJoint]) -> str | None:
    """Why a run does not start; None where it does."""
    try:
        place = arm.connect().position
        arm.enable(ControlMode.POSITION, stated_limits(joints), StopPolicy.HOLD, 1.0, CYCLE_S)
        state = arm.exchange(Setpoint(place, np.zeros(len(joints))))
    except DriverError as error:
        return str(error)
    finally:
        arm.disconnect()
    return str(state.faults[0]) if state.faults else None
