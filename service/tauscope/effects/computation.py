"""Computation that effects and fits share: two threads, and a cache of the last few results."""

from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Generic, TypeVar

Item = TypeVar("Item")
Done = TypeVar("Done")
Key = TypeVar("Key", bound=Hashable)
Made = TypeVar("Made")
THREADS = 2  # more threads gain nothing: they share the memory's speed, and Python between arrays


def side_by_side(work: Callable[[Item], Done], items: Iterable[Item]) -> list[Done]:
    """The result of every item, in their order."""
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(work, items))


class LastFew(Generic[Key, Made]):
    """A cache of the last few results. Threads may ask at once; two that ask for the same may both compute it."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._kept: dict[Key, Made] = {}
        self._lock = Lock()

    def get(self, key: Key, make: Callable[[], Made]) -> Made:
        with self._lock:
            if key in self._kept:
                self._kept[key] = found = self._kept.pop(key)
                return found
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > self._count:
                del self._kept[next(iter(self._kept))]
        return made

    @property
    def latest(self) -> Made | None:
        """The result that was used last; None at first."""
        with self._lock:
            return self._kept[next(reversed(self._kept))] if self._kept else None
