"""How long answers usually take on a bus and its adapter, and how much later than that one came."""

from collections import deque
from statistics import median

REMEMBERED = 31
"""Answers by which it is known how long they usually take: adapters differ."""


class AnswerTime:
    """Compares how long each answer took with the median of the last ones."""

    def __init__(self) -> None:
        """Nothing is known yet, and nothing is late."""
        self._taken_ns: deque[int] = deque(maxlen=REMEMBERED)

    @property
    def usual_ns(self) -> int:
        """Median of the last answers' times; 0 where there was none [ns]."""
        return round(median(self._taken_ns)) if self._taken_ns else 0

    def late_ns(self, taken_ns: int) -> int:
        """How much later than usual an answer came [ns].

        Parameters
        ----------
        taken_ns : int
            from the question to the last byte or frame of the answer [ns]
        """
        self._taken_ns.append(taken_ns)
        return max(0, taken_ns - self.usual_ns)
