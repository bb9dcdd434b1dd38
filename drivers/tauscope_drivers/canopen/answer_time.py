"""How late drives answer: what waited on its way shows when it was asked, but not when SYNC came to the drives."""

from collections import deque
from statistics import median

REMEMBERED = 31
"""Answers by which it is known what is usual: adapters take their time, each its own."""


class AnswerTime:
    """Compares how long each answer took with what is usual on this bus and adapter."""

    def __init__(self) -> None:
        """Nothing is known yet, and nothing is late."""
        self._taken_ns: deque[int] = deque(maxlen=REMEMBERED)

    def late_ns(self, taken_ns: int) -> int:
        """How much later than usual an answer came [ns].

        Parameters
        ----------
        taken_ns : int
            from SYNC to the last frame of the answer [ns]
        """
        self._taken_ns.append(taken_ns)
        return max(0, taken_ns - round(median(self._taken_ns)))
