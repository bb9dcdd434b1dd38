"""What was made last, kept for whoever asks for the same."""

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Made = TypeVar("Made")


class LastFew(Generic[Key, Made]):
    """Keeps what was asked for last. Threads may ask at once; what two ask for at the same time, both make."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._kept: dict[Key, Made] = {}
        self._lock = Lock()

    def get(self, key: Key, make: Callable[[], Made]) -> Made:
        """What belongs to a key."""
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
        """What was asked for last; None where nothing was."""
        with self._lock:
            return self._kept[next(reversed(self._kept))] if self._kept else None
