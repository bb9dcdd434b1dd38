"""Work that a thread of this process leads, as runs and campaigns are; each can be stopped at any time."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Supervisor(Protocol):
    """Leads one piece of work."""

    def lead(self) -> None:
        """Take it to its end; never raises."""
        ...

    def stop(self) -> None:
        """Stop it, whatever it is doing; takes no lock, waits for nothing, may be called any number of times."""
        ...


L = TypeVar("L", bound=Supervisor)


@dataclass(frozen=True, eq=False)
class _Supervised(Generic[L]):
    """A piece of work that goes on, and the thread that leads it."""

    leader: L
    thread: threading.Thread


class SupervisedThreads(Generic[L]):
    """Everything that goes on, by identifier. Reading it takes no lock: nobody who is stuck can hold up a stop."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._lock = threading.Lock()
        # Replaced as a whole, never changed: whoever reads it sees one state of affairs.
        self._active: Mapping[str, _Supervised[L]] = {}

    def begin(self, identifier: str, leader: L, then: Callable[[], None]) -> None:
        """Lead some work in a thread of its own."""

        def run() -> None:
            try:
                leader.lead()
                then()
            finally:
                with self._lock:
                    self._active = {name: led for name, led in self._active.items() if name != identifier}

        thread = threading.Thread(target=run, name=f"lead-{identifier}", daemon=True)
        with self._lock:
            self._active = {**self._active, identifier: _Supervised(leader, thread)}
        thread.start()

    def find(self, identifier: str) -> L | None:
        """Who leads some work; None where it does not go on."""
        led = self._active.get(identifier)
        return None if led is None else led.leader

    def identifiers(self) -> tuple[str, ...]:
        """What goes on now."""
        return tuple(self._active)

    def supervisors(self) -> tuple[L, ...]:
        """Who leads what goes on now."""
        return tuple(led.leader for led in self._active.values())

    def join(self, patience_s: float) -> None:
        """Wait until everything has ended, or patience has.

        Parameters
        ----------
        patience_s : float
            for each piece of work [s]
        """
        for led in self._active.values():
            led.thread.join(patience_s)
