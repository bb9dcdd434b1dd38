"""What can go wrong on a bus of drives, to be set off by a test at an instant of its choice."""

import heapq
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class FaultKind(StrEnum):
    """What happens."""

    LOSE = "lose"  # the device's next answers do not arrive
    CORRUPT = "corrupt"  # one bit of them is wrong
    LATE = "late"  # they arrive `seconds` late
    DUPLICATE = "duplicate"  # they arrive twice
    SILENT = "silent"  # the device neither hears nor answers for `seconds`
    BUS_OFF = "bus-off"  # its CAN controller has seen too many errors and leaves the bus for `seconds`; on CAN alone
    OVER_TEMPERATURE = "over-temperature"
    OVERLOAD = "overload"
    ENCODER_JUMP = "encoder-jump"  # its position jumps by `counts`
    RESET = "reset"  # the device restarts and is away for `seconds`
    POWER_DIP = "power-dip"  # all devices restart and are away for `seconds`


@dataclass(frozen=True)
class InjectedFault:
    """One fault.

    `at_s`: when, by the emulator's clock, and in what a test asks for counted from then; at once where that has passed
        [s].
    `seconds`: how late, or how long [s].
    """

    kind: FaultKind
    device: int = 0
    at_s: float = 0.0
    count: int = 1
    seconds: float = 0.3
    counts: int = 0


def faults_from(documents: Iterable[dict[str, Any]], now_s: float) -> list[InjectedFault]:
    """Faults that a test asks for, by the emulator's clock."""
    return [
        InjectedFault(**{**document, "kind": FaultKind(document["kind"]), "at_s": now_s + document["at_s"]})
        for document in documents
    ]


@dataclass(order=True)
class _Scheduled:
    at_s: float
    number: int
    fault: InjectedFault = field(compare=False)


class FaultSchedule:
    """Faults in the order of their instants."""

    def __init__(self) -> None:
        self._queue: list[_Scheduled] = []
        self._number = 0

    def add(self, faults: Iterable[InjectedFault]) -> None:
        """Plan faults."""
        for fault in faults:
            self._number += 1
            heapq.heappush(self._queue, _Scheduled(fault.at_s, self._number, fault))

    def run(self, now_s: float, carry_out: Callable[[InjectedFault], None]) -> None:
        """Carry out what is due."""
        while self._queue and self._queue[0].at_s <= now_s:
            carry_out(heapq.heappop(self._queue).fault)
