"""Faults of the answers of a servo: they arrive late, twice, damaged, or not at all."""

from dataclasses import dataclass

from tauscope_sim.emulation.fault_kit import FaultKind


@dataclass
class AnswerFaults:
    """What is to happen to the next answers of one servo.

    kind : FaultKind or None
        None for nothing
    """

    kind: FaultKind | None = None
    count: int = 0
    seconds: float = 0.0

    def apply(self, frame: bytes, due_s: float) -> list[tuple[float, bytes]]:
        """An answer as it arrives: not at all, once or twice.

        Parameters
        ----------
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
