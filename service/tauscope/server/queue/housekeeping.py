"""What is done beside everything else, again and again: nothing waits for it, and no failure of it stops anything."""

import logging
import threading
from collections.abc import Callable, Sequence

from tauscope.errors import TauscopeError

_log = logging.getLogger("tauscope.jobs")
PERIOD_S = 1.0  # how often the tasks are done [s]


class Housekeeping:
    """A thread that does small tasks, one after the other, again and again."""

    def __init__(self, tasks: Sequence[Callable[[], object]], period_s: float = PERIOD_S) -> None:
        """Prepare; nothing is done before `start`. `period_s`: pause between two rounds [s]."""
        self._tasks, self._period_s = tasks, period_s
        self._closing = threading.Event()
        self._failing: set[Callable[[], object]] = set()
        self._thread = threading.Thread(target=self._run, name="housekeeping", daemon=True)

    def start(self) -> None:
        """Begin; the first round is done after a pause."""
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()

    def round(self) -> None:
        """Do every task once; a failure is logged when it begins and when it is over."""
        for task in self._tasks:
            if self._closing.is_set():
                return
            try:
                task()
            except Exception as error:
                if task not in self._failing and isinstance(error, TauscopeError | OSError):
                    _log.warning("housekeeping: %s; it is tried again", error)
                elif task not in self._failing:
                    _log.exception("housekeeping failed for an unforeseen reason; it is tried again")
                self._failing.add(task)
            else:
                if task in self._failing:
                    _log.warning("housekeeping works again")
                self._failing.discard(task)

    def _run(self) -> None:
        while not self._closing.wait(self._period_s):
            self.round()
