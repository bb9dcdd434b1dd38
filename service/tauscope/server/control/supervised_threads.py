"""Threads that supervise runs and campaigns, and the part that the managers of both share."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from tauscope.server.store.data_folder import ItemStore

CLOSE_TIMEOUT_S = 15.0
"""How long a run or a campaign may take to stop when the service ends [s]. Its control process may last longer."""


class Supervisor(Protocol):
    @property
    def state(self) -> Any: ...

    def run(self) -> None:
        """Supervise to the end; never raises."""

    def stop(self) -> None:
        """Stop, in any state; takes no lock, returns at once, may be called repeatedly."""

    def interrupt(self) -> None:
        """Stop because the service ends; as `stop` otherwise."""


S = TypeVar("S", bound=Supervisor)


@dataclass(frozen=True, eq=False)
class _Supervised(Generic[S]):
    supervisor: S
    thread: threading.Thread


class SupervisedThreads(Generic[S]):
    """The active supervisors by identifier. Reading takes no lock, so that a stuck thread cannot delay a stop."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # Replaced as a whole, never changed: each reader sees one consistent state.
        self._active: Mapping[str, _Supervised[S]] = {}

    def start(self, identifier: str, supervisor: S, then: Callable[[], None] = lambda: None) -> None:
        """Run a supervisor in a thread of its own, and call `then` after it."""

        def run() -> None:
            try:
                supervisor.run()
                then()
            finally:
                with self._lock:
                    self._active = {name: entry for name, entry in self._active.items() if name != identifier}

        thread = threading.Thread(target=run, name=f"supervise-{identifier}", daemon=True)
        with self._lock:
            self._active = {**self._active, identifier: _Supervised(supervisor, thread)}
        thread.start()

    def find(self, identifier: str) -> S | None:
        entry = self._active.get(identifier)
        return None if entry is None else entry.supervisor

    def identifiers(self) -> tuple[str, ...]:
        return tuple(self._active)

    def supervisors(self) -> tuple[S, ...]:
        return tuple(entry.supervisor for entry in self._active.values())

    def join(self, timeout_s: float) -> None:
        """Wait until all threads have ended, for at most `timeout_s` each [s]."""
        for entry in self._active.values():
            entry.thread.join(timeout_s)


class Manager(Generic[S]):
    """Active items and the folders of all items of a kind. Every method may be called from any thread."""

    def __init__(self, items: ItemStore) -> None:
        self.items = items
        self._lock = threading.Lock()
        self._threads: SupervisedThreads[S] = SupervisedThreads()
        self._is_closed = False
        items.tidy()

    def remove(self, identifier: str) -> bool:
        """Remove an item that has ended, False where it is active. Raises NotFoundError if there is none."""
        if self._threads.find(identifier) is not None:
            return False
        self.items.remove(identifier)
        return True

    def stop(self, identifier: str) -> Any:
        """Stop an item without any lock; returns the state in which it stood, None where it is not active."""
        supervisor = self._threads.find(identifier)
        if supervisor is None:
            return None
        state = supervisor.state
        supervisor.stop()
        return state

    def stop_all(self) -> list[str]:
        """Stop all that is active, and accept further items; takes no lock. Returns the identifiers."""
        active = [(identifier, self._threads.find(identifier)) for identifier in self._threads.identifiers()]
        for _, supervisor in active:
            if supervisor is not None:
                supervisor.stop()
        return [identifier for identifier, supervisor in active if supervisor is not None]

    def begin_close(self) -> None:
        """Stop all that is active and accept no further items; returns at once."""
        self._is_closed = True
        for supervisor in self._threads.supervisors():
            supervisor.interrupt()

    def close(self) -> None:
        """Stop all that is active, and wait for its end for at most `CLOSE_TIMEOUT_S`."""
        with self._lock:
            self.begin_close()
        self._threads.join(CLOSE_TIMEOUT_S)
