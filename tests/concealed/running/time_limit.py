"""An end to what takes too long, whatever it is doing: in a process's main thread, where signals arrive."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class TimeIsUp(BaseException):
    """The limit was reached. No `Exception`: nobody who catches those because a trial may fail is to catch this."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimeIsUp` in the block after so long; in any other thread than the main one nothing does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def is_up(_number: int, _frame: FrameType | None) -> None:
        raise TimeIsUp

    handler = signal.signal(signal.SIGALRM, is_up)
    before = signal.setitimer(signal.ITIMER_REAL, max(seconds, 1e-6))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)
        signal.setitimer(signal.ITIMER_REAL, *before)  # a test's own limit, which counts on from where it was
