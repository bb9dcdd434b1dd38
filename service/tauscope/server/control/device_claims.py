"""Who has which arm: one run, or one campaign, at a time."""

import threading

from tauscope.errors import AcquisitionError
from tauscope.robot.messages import one_line


class BusyError(AcquisitionError):
    """Somebody else has the arm, or too many runs go on at a time."""


class DeviceClaims:
    """Arms and their holders; every method may be called from any thread and returns at once."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._holders: dict[str, str] = {}

    def take(self, device: str, holder: str) -> None:
        """Take an arm. Raises BusyError if somebody else has it, or as many arms are held as are allowed."""
        with self._lock:
            present = self._holders.get(device)
            if present is not None and present != holder:
                raise self._busy(device, present)
            if present is None and len(self._holders) >= self._most:
                raise BusyError(f"{len(self._holders)} arms move already; wait until one of them has ended")
            self._holders[device] = holder

    def require_free(self, device: str) -> None:
        """Say at once that somebody has an arm, before work is begun for whoever wants it.

        Raises BusyError if somebody has it.
        """
        holder = self._holders.get(device)
        if holder is not None:
            raise self._busy(device, holder)

    def release(self, device: str, holder: str) -> None:
        """Let go of an arm; nothing happens where somebody else has it."""
        with self._lock:
            if self._holders.get(device) == holder:
                del self._holders[device]

    @staticmethod
    def _busy(device: str, holder: str) -> BusyError:
        """Somebody has it."""
        return BusyError(one_line(f"{device}: {holder} has it; wait until that has ended, or stop it"))
