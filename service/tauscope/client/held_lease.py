"""A lease that a program holds: renewed by a thread as long as the program lives, given back in the end."""

import threading
from collections.abc import Callable
from types import TracebackType

from tauscope.client.transport import ApiError
from tauscope.server.http.leases import LeaseAnswer

BEATS_A_TTL = 3.0
"""Heartbeats in the time that the lease lasts without one."""


class HeldLease:
    """A lease kept by heartbeats; use it as a context. When the program hangs or dies, the arm stops by itself."""

    def __init__(self, lease: LeaseAnswer, beat: Callable[[], object], release: Callable[[], object]) -> None:
        self.lease = lease
        self.lost: str | None = None
        self._beat, self._release = beat, release
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._keep, name=lease.id, daemon=True)

    @property
    def token(self) -> str:
        """What to send as header ``Lease-Token``."""
        return self.lease.token or ""

    def require(self) -> None:
        """Refuse to go on with a lease that was lost. Raises ApiError if it was."""
        if self.lost is not None:
            raise ApiError("lease-lost", 409, self.lost)

    def __enter__(self) -> "HeldLease":
        """Keep the lease from now on."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the lease back; what still moves by it stops."""
        self._is_over.set()
        self._thread.join()
        if self.lost is None:
            try:
                self._release()
            except ApiError:
                # It ends by itself; what happened inside the context is more important.
                return

    def _keep(self) -> None:
        """Renew the lease until it is over or lost; a beat that got lost on the way is made up for by the next."""
        while not self._is_over.wait(self.lease.ttl_s / BEATS_A_TTL):
            try:
                self._beat()
            except ApiError as error:
                if error.problem_code == "lease-lost":
                    self.lost = error.detail
                    return
