"""Buses of serial servos: how many cycles they carry, whose answer may still come, and how late one is."""

import time
from abc import ABC, abstractmethod
from collections.abc import Collection, Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from tauscope_drivers.clock import AnswerTime, Clock, MonotonicClock
from tauscope_drivers.errors import DriverError
from tauscope_drivers.serial_port import BITS_PER_BYTE, SerialPort

# share of a cycle that the bus may take; the rest is for the servos' own turnaround and for the host
LARGEST_LOAD = 0.85
RETURN_DELAY_UNIT_S = 2e-6  # one unit of Return Delay Time [s]
SHORTEST_RETURN_DELAY_S = 2e-6  # of a servo whose Return Delay Time is 0 [s]


@dataclass(frozen=True)
class CycleTraffic:
    """What goes over the bus in one cycle."""

    servos: int
    bytes: int  # without stuffing; `answers`: packets that wait for a return delay; `reads`: that wait for the adapter
    answers: int
    reads: int
    delay_remedy: str  # what to do about a long return delay


@dataclass(frozen=True)
class BusTiming:
    """How fast a bus is."""

    baud: float
    return_delay_s: float  # largest Return Delay Time of the servos [s]
    latency_s: float  # latency timer of the adapter; 0 on a plain serial line [s]


def cycle_parts(traffic: CycleTraffic, timing: BusTiming) -> dict[str, float]:
    """Time of one cycle by what takes it [s]."""
    return {
        f"the wire at {timing.baud:g} baud": traffic.bytes * BITS_PER_BYTE / timing.baud,
        f"a Return Delay Time of {timing.return_delay_s * 1e6:.0f} µs": traffic.answers * timing.return_delay_s,
        f"the adapter's latency timer of {timing.latency_s * 1e3:g} ms": traffic.reads * timing.latency_s,
    }


def largest_rate_hz(traffic: CycleTraffic, timing: BusTiming, load: float = LARGEST_LOAD) -> float:
    """Most cycles a second [Hz]."""
    return load / sum(cycle_parts(traffic, timing).values())


def require_rate(rate_hz: float, traffic: CycleTraffic, timing: BusTiming) -> None:
    """Refuse a rate that the bus does not carry. Raises DriverError ``refused``: what limits it, what is possible."""
    most = largest_rate_hz(traffic, timing)
    if rate_hz <= most:
        return
    reason, remedy = largest_part(traffic, timing)
    raise DriverError.refusal(
        f"{rate_hz:g} Hz: {reason} and {traffic.servos} servos get {most:.0f} Hz at most; {remedy}, or ask for less"
    )


def largest_part(traffic: CycleTraffic, timing: BusTiming) -> tuple[str, str]:
    """What takes most of a cycle, and what to do about it."""
    parts = cycle_parts(traffic, timing)
    longest = max(parts, key=parts.__getitem__)
    remedies = "use a higher baud rate", traffic.delay_remedy, "write 1 to its latency_timer in /sys/class/tty"
    return f"{longest} takes {parts[longest] * 1e3:.2f} ms of each cycle", remedies[list(parts).index(longest)]


FACTORY_RETURN_DELAY_S = 500e-6  # Return Delay Time of a servo as delivered: 250 units [s]
ATTEMPTS = 3  # how often a single servo is asked outside the control loop
PATIENCE_S = 0.02  # how much longer a single servo is waited for there [s]

# answers have come 133 ms late where a machine stood still; a control loop gives an arm up long before this
_LATEST_ANSWER_NS = 500_000_000
_PING_SLOT_S = 0.003  # time that a ping to all leaves each ID [s]

_Status = TypeVar("_Status")


@dataclass(frozen=True)
class Answers(Generic[_Status]):
    """Answers to one question to many servos."""

    asked_ns: int  # instant at which the question had left [ns, by the bus' clock]
    late_ns: int  # how much later than usual the last answer came [ns]
    statuses: dict[int, _Status]  # by ID
    beyond_ns: int = 0  # how much longer than bus and adapter should take for it [ns]


class FrameParser(ABC):
    """Finds whole frames in what comes from a port; noise and damaged frames are passed over, and counted."""

    header: bytes
    fixed_bytes: int  # bytes from which a frame's end is known
    longest: int  # frames that say to be longer are noise [bytes]

    def __init__(self, longest: int | None = None) -> None:
        """Begin with nothing. `longest`: longest frame that is believed: a damaged length swallows no more [bytes]."""
        self.discarded = 0
        self.longest = longest or self.longest
        self._buffer = bytearray()

    @abstractmethod
    def find_end(self, start: bytearray) -> int | None:
        """Length of the frame that begins so [bytes]; None where none can begin so."""

    @abstractmethod
    def is_whole(self, frame: bytes) -> bool:
        """Whether the checksum is right."""

    def feed(self, received: bytes) -> Iterator[bytes]:
        """Frames that are complete now and whose checksum is right, header included."""
        self._buffer += received
        while (frame := self._next_frame()) is not None:
            yield frame

    @property
    def pending(self) -> bytes:
        """The frame that has begun and is not complete."""
        return bytes(self._buffer)

    def _next_frame(self) -> bytes | None:
        buffer = self._buffer
        while True:
            start = buffer.find(self.header)
            if start < 0:
                self._discard(max(0, len(buffer) - len(self.header) + 1))
                return None
            self._discard(start)
            if len(buffer) < self.fixed_bytes:
                return None
            end = self.find_end(buffer)
            if end is None or end > self.longest:
                self._discard(1)
            elif len(buffer) < end:
                return None
            elif not self.is_whole(frame := bytes(buffer[:end])):
                self._discard(1)
            else:
                del buffer[:end]
                return frame

    def _discard(self, count: int) -> None:
        del self._buffer[:count]
        self.discarded += count


class SerialServoBus(Generic[_Status]):
    """Speaks to the servos of one port; one thread's own. Nothing in an answer says to which question it belongs."""

    def __init__(self, port: SerialPort, clock: Clock | None = None) -> None:
        self.port = port
        self.return_delay_s = FACTORY_RETURN_DELAY_S
        self._clock = MonotonicClock() if clock is None else clock
        self._missed_ns: dict[tuple[int, int], int] = {}
        self._answer_times: dict[Hashable, AnswerTime] = {}

    def _ask_everybody(self, ping: bytes, answer_bytes: int, slots: int, parser: FrameParser) -> Iterator[bytes]:
        """Frames that come after a ping to all."""
        self.port.send(ping)
        deadline = self.port.reply_deadline_ns(answer_bytes * slots, slots * _PING_SLOT_S)
        while received := self.port.receive(deadline):
            yield from parser.feed(received)

    def _send_question(self, request: bytes) -> int:
        """Send a question to many servos; when it has left [ns]."""
        # Taken before: who is woken by the bytes may run before this process does again.
        asked_ns = self._clock.now_ns() + round(self._wire_s(len(request)) * 1e9)
        self.port.send(request)
        return asked_ns

    def _time_answers(
        self, kind: Hashable, asked_ns: int, answered_ns: int, usual_s: float, found: dict[int, _Status]
    ) -> Answers[_Status]:
        """Say how late answers are. `kind`: questions that take as long; `usual_s`: what bus and servos take [s]."""
        if not found:
            return Answers(asked_ns, 0, found)
        taken_ns = answered_ns - asked_ns - round((usual_s + self.port.latency_s) * 1e9)
        late_ns = self._answer_times.setdefault(kind, AnswerTime()).late_ns(taken_ns)
        return Answers(asked_ns, late_ns, found, max(0, taken_ns))

    def _find_owing(self, servos: Sequence[int], length: int) -> set[int]:
        """Servos whose answer of this length to an earlier question may still be under way."""
        since_ns = time.monotonic_ns() - _LATEST_ANSWER_NS
        return {servo for servo in servos if self._missed_ns.get((servo, length), 0) > since_ns}

    def _miss(self, servos: Collection[int], length: int) -> None:
        """Note who has not answered: that answer may come yet."""
        self._missed_ns |= dict.fromkeys(((servo, length) for servo in servos), time.monotonic_ns())

    def _wire_s(self, count: int) -> float:
        return count * BITS_PER_BYTE / self.port.baudrate


def learn_latency(port: SerialPort, answers: Sequence[Answers[_Status]]) -> None:
    """Add what an adapter takes beyond its timer: one that is slow by a constant is no faster in any answer."""
    port.latency_s += min((one.beyond_ns for one in answers if one.statuses), default=0) * 1e-9
