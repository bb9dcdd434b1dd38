"""A serial port whose emulated servos answer in the same thread, at once."""

import time
from collections.abc import Iterable
from typing import ClassVar

from tauscope_sim.dynamixel_bus import ServoSpecification
from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.servo import EmulatedServo


class WiredPort:
    """Stands in for `SerialPort`; the servos are those that were wired last."""

    latency_s = 0.001
    wired: ClassVar[EmulatedBus]

    def __init__(self, path: str, baud: int, slack_s: float = 0.002) -> None:
        self.path, self.baudrate = path, baud
        self._come = b""

    @classmethod
    def wire(cls, servos: Iterable[tuple[ServoSpecification, float]]) -> list[EmulatedServo]:
        """Connect servos, each of which stands at a place [rad]."""
        made = []
        for specification, place in servos:
            servo = EmulatedServo(specification)
            servo.take_motion(place, 0.0, 0.0)
            servo.sense(0.0)
            made.append(servo)
        cls.wired = EmulatedBus(made, paced=False)
        return made

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass

    def send(self, frame: bytes) -> None:
        now = time.monotonic()
        instructions = self.wired.hear(frame, now)
        self._come = b"".join(data for _, data in self.wired.answer(instructions, now))

    def receive(self, deadline_ns: int) -> bytes:
        come, self._come = self._come, b""
        return come

    def drain(self) -> None:
        self._come = b""

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        return time.monotonic_ns()
