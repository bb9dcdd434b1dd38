"""What can go wrong on a bus of servos, to be set off by a test at an instant of its choice."""

import heapq
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum


class FaultKind(StrEnum):
    """What happens."""

    LOSE = "lose"
    """The servo's next answers do not arrive."""
    CORRUPT = "corrupt"
    """One bit of them is wrong."""
    LATE = "late"
    """They arrive `seconds` late."""
    DUPLICATE = "duplicate"
    """They arrive twice."""
    SILENT = "silent"
    """The servo neither hears nor answers for `seconds`."""
    OVER_TEMPERATURE = "over-temperature"
    OVERLOAD = "overload"
    ENCODER_JUMP = "encoder-jump"
    """Its position jumps by `counts`."""
    RESET = "reset"
    """The servo restarts and is away for `seconds`."""
    POWER_DIP = "power-dip"
    """All servos restart and are away for `seconds`."""


@dataclass(frozen=True)
class InjectedFault:
    """One fault.

    kind : FaultKind
        what happens
    servo : int
        ID; of no matter for a power dip
    at_s : float
        when, in seconds of the device's clock; at once where that has passed [s]
    count : int
        for how many answers
    seconds : float
        how late, or how long [s]
    counts : int
        how far an encoder jumps
    """

    kind: FaultKind
    servo: int = 0
    at_s: float = 0.0
    count: int = 1
    seconds: float = 0.3
    counts: int = 0


@dataclass
class AnswerFaults:
    """What is to happen to the next answers of one servo.

    kind : FaultKind or None
        None for nothing
    count : int
        how many answers are left
    seconds : float
        how late
    """

    kind: FaultKind | None = None
    count: int = 0
    seconds: float = 0.0

    def apply(self, frame: bytes, due_s: float) -> list[tuple[float, bytes]]:
        """An answer as it arrives: not at all, once or twice.

        Parameters
        ----------
        frame : bytes
            as it was sent
        due_s : float
            when it would arrive [s]
        """
        if self.kind is None or self.count <= 0:
            return [(due_s, frame)]
        self.count -= 1
        if self.kind is FaultKind.LOSE:
            return []
        if self.kind is FaultKind.CORRUPT:
            return [(due_s, frame[:-3] + bytes([frame[-3] ^ 0x10]) + frame[-2:])]
        if self.kind is FaultKind.LATE:
            return [(due_s + self.seconds, frame)]
        return [(due_s, frame), (due_s, frame)]


@dataclass(order=True)
class _Scheduled:
    at_s: float
    number: int
    fault: InjectedFault = field(compare=False)


class FaultSchedule:
    """Faults in the order of their instants."""

    def __init__(self) -> None:
        """No fault."""
        self._queue: list[_Scheduled] = []
        self._number = 0

    def add(self, faults: Iterable[InjectedFault]) -> None:
        """Plan faults.

        Parameters
        ----------
        faults : iterable of InjectedFault
            in any order
        """
        for fault in faults:
            self._number += 1
            heapq.heappush(self._queue, _Scheduled(fault.at_s, self._number, fault))

    def run(self, now_s: float, carry_out: Callable[[InjectedFault], None]) -> None:
        """Carry out what is due.

        Parameters
        ----------
        now_s : float
            present instant [s]
        carry_out : callable
            takes the fault
        """
        while self._queue and self._queue[0].at_s <= now_s:
            carry_out(heapq.heappop(self._queue).fault)
