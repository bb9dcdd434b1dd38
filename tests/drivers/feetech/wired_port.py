"""A serial port whose emulated servos answer in the same thread, at once."""

import time
from collections.abc import Iterable
from typing import ClassVar

from feetech_bus.bus import FeetechBus
from feetech_bus.servo import FeetechServo
from feetech_bus.specification import ServoSpecification


class WiredPort:
    """Replaces `SerialPort`; the servos are those that were wired last."""

    latency_s = 0.001
    wired: ClassVar[FeetechBus]

    def __init__(self, path: str, baud: int, slack_s: float = 0.002) -> None:
        self.path, self.baudrate = path, baud
        self._come = b""

    @classmethod
    def wire(cls, servos: Iterable[tuple[ServoSpecification, float]], *, echoes: bool = False) -> list[FeetechServo]:
        """Connect servos, each of which stands at a place [rad]."""
        made = []
        for specification, place in servos:
            servo = FeetechServo(specification)
            servo.take_motion(place, 0.0, 0.0)
            servo.sense(0.0)
            made.append(servo)
        cls.wired = FeetechBus(made, paced=False, echoes=echoes)
        return made

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass

    def send(self, frame: bytes) -> None:
        now = time.monotonic()
        answers = self.wired.answer(self.wired.hear(frame, now), now)
        self._come = b"".join(data for _, data in answers)

    def receive(self, deadline_ns: int) -> bytes:
        come, self._come = self._come, b""
        return come

    def drain(self) -> None:
        self._come = b""

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        return time.monotonic_ns()
