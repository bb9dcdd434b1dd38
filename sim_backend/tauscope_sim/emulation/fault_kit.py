"""What can go wrong on a bus of drives, to be set off by a test at an instant of its choice."""

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Any, Generic, TypeVar


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
    """One fault. `at_s`: when, by the emulator's clock; a test's counts from then; at once where it has passed [s]."""

    kind: FaultKind
    device: int = 0
    at_s: float = 0.0
    count: int = 1
    seconds: float = 0.3  # how late, or how long [s]
    counts: int = 0


def faults_from(documents: Iterable[dict[str, Any]], now_s: float) -> list[InjectedFault]:
    """Faults that a test asks for, by the emulator's clock."""
    return [
        InjectedFault(**{**document, "kind": FaultKind(document["kind"]), "at_s": now_s + document["at_s"]})
        for document in documents
    ]


_Item = TypeVar("_Item")


class TimedQueue(Generic[_Item]):
    """What happens at an instant each, in their order; of the same instant the first that was put in comes first."""

    def __init__(self) -> None:
        self._queue: list[tuple[float, int, _Item]] = []
        self._number = 0

    @property
    def next_s(self) -> float:
        """When the next is due; infinite where none is left [s]."""
        return self._queue[0][0] if self._queue else inf

    def put(self, at_s: float, item: _Item) -> None:
        """Plan one."""
        self._number += 1
        heapq.heappush(self._queue, (at_s, self._number, item))

    def take_due(self, now_s: float) -> Iterator[_Item]:
        """Take out what is due, one after the other."""
        while self._queue and self._queue[0][0] <= now_s:
            yield heapq.heappop(self._queue)[2]


@dataclass
class AnswerFaults:
    """What is to happen to the next answers of one device; nothing where `kind` is None."""

    kind: FaultKind | None = None
    count: int = 0
    seconds: float = 0.0

    def apply(self, frame: bytes, due_s: float) -> list[tuple[float, bytes]]:
        """An answer as it arrives: not at all, once or twice. `due_s`: when it would arrive [s]."""
        kind = self.next_kind()
        if kind is FaultKind.CORRUPT:
            frame = frame[:-3] + bytes([frame[-3] ^ 0x10]) + frame[-2:]
        return [(at_s, frame) for at_s in self.arrivals(kind, due_s)]

    def next_kind(self) -> FaultKind | None:
        """What happens to the next answer."""
        if self.count <= 0:
            return None
        self.count -= 1
        return self.kind

    def arrivals(self, kind: FaultKind | None, due_s: float) -> list[float]:
        """When an answer arrives to which this happens. `due_s`: when it would arrive [s]."""
        changed = {FaultKind.LOSE: [], FaultKind.LATE: [due_s + self.seconds], FaultKind.DUPLICATE: [due_s, due_s]}
        return [due_s] if kind is None else changed.get(kind, [due_s])
