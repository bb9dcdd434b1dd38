"""Frames on the wire: when they arrive, and what can happen to them on the way."""

import heapq

from tauscope_sim.canopen_bus.drive import Frame
from tauscope_sim.emulation.fault_kit import FaultKind

_FRAME_BITS = 47
"""Of a standard frame without data, with the space behind it."""

_BITS_PER_STUFFED_BIT = 5.0


class Wire:
    """One CAN bus between drives and adapter: a frame after the other, the lowest identifier first.

    Where a frame is disturbed, its sender tries again by itself: a disturbance on CAN costs time and not content. What
    can be lost, doubled or late all the same is lost in the adapter.
    """

    def __init__(self, bit_rate: float) -> None:
        """Idle. `bit_rate`: infinite where frames arrive at once [bit/s]."""
        self._bit_s = 1.0 / bit_rate
        self._free_s = 0.0
        self._count = 0
        self._arriving: list[tuple[float, int, Frame]] = []
        self._faults: dict[int, tuple[FaultKind, int, float]] = {}

    def carry(self, frames: list[Frame], now_s: float) -> None:
        """Send frames of the drives to the adapter.

        `frames`: list of (int, bytes), that want to be sent now; `now_s`: present instant [s].
        """
        for frame in sorted(frames):
            self._free_s = max(now_s, self._free_s) + self.duration_s(frame)
            for arrival_s in self._arrivals(frame):
                self._count += 1
                heapq.heappush(self._arriving, (arrival_s, self._count, frame))

    def occupy(self, frame: Frame, now_s: float) -> None:
        """Let a frame of the master take its time. `now_s`: present instant [s]."""
        self._free_s = max(now_s, self._free_s) + self.duration_s(frame)

    def arrived(self, now_s: float) -> list[Frame]:
        """Frames that have reached the adapter. `now_s`: present instant [s]."""
        frames = []
        while self._arriving and self._arriving[0][0] <= now_s:
            frames.append(heapq.heappop(self._arriving)[2])
        return frames

    @property
    def next_arrival_s(self) -> float:
        """When the next frame reaches the adapter; infinite where none is under way [s]."""
        return self._arriving[0][0] if self._arriving else float("inf")

    def disturb(self, node_id: int, kind: FaultKind, count: int, seconds: float) -> None:
        """Let something happen to the next process data of a node. `seconds`: how late [s]."""
        self._faults[node_id] = (kind, count, seconds)

    def duration_s(self, frame: Frame) -> float:
        """Time of a frame on the wire, with as many stuffed bits as mixed data have [s]."""
        bits = _FRAME_BITS + 8 * len(frame[1])
        return (bits + bits / (4.0 * _BITS_PER_STUFFED_BIT)) * self._bit_s

    def _arrivals(self, frame: Frame) -> list[float]:
        """Instants at which a frame arrives: none, one or two."""
        node = frame[0] & 0x7F
        kind, count, seconds = self._faults.get(node, (None, 0, 0.0))
        if kind is None or count <= 0 or not 0x180 <= frame[0] < 0x580:
            return [self._free_s]
        self._faults[node] = (kind, count - 1, seconds)
        match kind:
            case FaultKind.LOSE:
                return []
            case FaultKind.CORRUPT:  # an error frame, and the whole frame again
                self._free_s += 2.0 * self.duration_s(frame)
                return [self._free_s]
            case FaultKind.LATE:
                return [self._free_s + seconds]
        return [self._free_s, self._free_s]
