"""Who has which arm: claims of what moves, leases that expire unless renewed, and permits to move.

A lease holds while the clock is before its end; no thread has to be alive for it to expire. Its secret is drawn anew:
a former holder is never taken for the present one.
"""

import hmac
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count

from typing_extensions import override

from tauscope.errors import AcquisitionError


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
        """Refuse an arm before work is begun for it. Raises BusyError if somebody has it."""
        holder = self._holders.get(device)
        if holder is not None:
            raise self._busy(device, holder)

    def release(self, device: str, holder: str) -> None:
        with self._lock:
            if self._holders.get(device) == holder:
                del self._holders[device]

    @staticmethod
    def _busy(device: str, holder: str) -> BusyError:
        return BusyError(f"{device}: {holder} has it; wait until that has ended, or stop it")


class Permit:
    """Leave to move one arm, here one without lease; takes no lock, touches no disk and returns at once."""

    def __init__(self, require: Callable[[], None] = lambda: None) -> None:
        """`require`: raises LeaseError if a motion may not begin."""
        self.require = require

    def find_end_reason(self) -> str | None:
        """Why a motion may not go on; None while it may."""
        return None

    def disarm(self) -> None:
        """Ask for the arm to be armed again before it moves again."""


FREE = Permit()  # leave that is never taken back


class LeaseError(AcquisitionError):
    """Something about the lease of an arm."""


class LeasedError(LeaseError):
    """Somebody else has the lease of the arm."""


class LeaseNeededError(LeaseError):
    """The arm moves for whoever has its lease, and none was shown."""


class LeaseLostError(LeaseError):
    """The lease that was shown is not the present one: it expired, was released, or somebody took the arm."""


class NotArmedError(LeaseError):
    """The lease is good, but nobody has armed it."""


LONGEST_TTL_S = 60.0  # longest time for which a lease may be given without a sign of life [s]


@dataclass(eq=False)
class Lease:
    """`ttl_s`: time without a heartbeat after which it ends, at `ends` [s]. Attributes are read without a lock."""

    id: str
    number: int
    device: str
    holder: str
    owner: str
    ttl_s: float
    secret: str
    ends: float
    is_armed: bool = False
    lost: str | None = None

    @property
    def token(self) -> str:
        return f"{self.number}-{self.secret}"


class LeasePermit(Permit):
    def __init__(self, lease: Lease, find_end_reason: Callable[[Lease], str | None]) -> None:
        super().__init__(self._require)
        self._lease, self._end_of = lease, find_end_reason

    def _require(self) -> None:
        lost = self._end_of(self._lease)
        if lost is not None:
            raise LeaseLostError(f"{self._lease.device}: lease {self._lease.number} ended: {lost}")
        if not self._lease.is_armed:
            hint = f"POST /api/v1/leases/{self._lease.id}/arm first"
            raise NotArmedError(f"{self._lease.device}: its lease is not armed; {hint}")

    @override
    def find_end_reason(self) -> str | None:
        lost = self._end_of(self._lease)
        if lost is not None:
            return f"lease {self._lease.number} of {self._lease.holder} ended: {lost}"
        return None if self._lease.is_armed else f"lease {self._lease.number} of {self._lease.holder} was disarmed"

    @override
    def disarm(self) -> None:
        self._lease.is_armed = False


Clock = Callable[[], float]  # [s]
LeaseEnd = Callable[[Lease, str], None]
"""Told that a lease has ended, and why; called by whoever notices, so that it must return at once."""


class Leases:
    """The leases of all arms. Reading takes no lock; every change does, and none of them waits but for `acquire`."""

    def __init__(self, claims: DeviceClaims, *, clock: Clock = time.monotonic, on_end: LeaseEnd | None = None) -> None:
        self._claims, self._numbers, self._clock = claims, count(1), clock
        self._on_end = on_end or (lambda _lease, _why: None)
        self._lock = threading.Lock()
        self._active: Mapping[str, Lease] = {}

    def active(self) -> list[Lease]:
        leases = [lease for lease in self._active.values() if self.find_end_reason(lease) is None]
        return sorted(leases, key=lambda lease: -lease.number)

    def seconds_left(self, lease: Lease) -> float:
        """How long a lease lasts without a further sign of life [s]."""
        return max(0.0, lease.ends - self._clock())

    def acquire(self, device: str, holder: str, owner: str, ttl_s: float, *, take: bool = False) -> Lease:
        """Lease an arm. Raises LeasedError if it is leased and not taken, BusyError if it moves without a lease."""
        with self._lock:
            present = self._present(device)
            if present is not None:
                if not take:
                    raise self._refuse_leased(present)
                self._finish(present, f"{holder} took the arm")
            number = next(self._numbers)
            lease = Lease(
                id=f"lease-{number}",
                number=number,
                device=device,
                holder=holder,
                owner=owner,
                ttl_s=ttl_s,
                secret=secrets.token_urlsafe(16),
                ends=self._clock() + ttl_s,
            )
            # First the lease, then the look at what moves: whoever begins to move does both the other way round.
            before = self._active
            self._active = {**before, device: lease}
            try:
                if present is None:
                    self._claims.require_free(device)
            except BaseException:
                self._active = before
                raise
        return lease

    def renew(self, device: str, token: str, owner: str) -> Lease:
        """Take a heartbeat. Raises LeaseLostError if that is not the present lease: one that has ended stays so."""
        with self._lock:
            lease = self.require(device, token, owner)
            lease.ends = self._clock() + lease.ttl_s
        return lease

    def arm(self, device: str, token: str, owner: str, *, armed: bool) -> Lease:
        """Let the arm move, or not any more. Raises LeaseLostError if that is not the present lease."""
        with self._lock:
            lease = self.require(device, token, owner)
            lease.is_armed = armed
        return lease

    def release(self, device: str, token: str, owner: str) -> None:
        """Give an arm back; what moves by the lease stops. Raises LeaseLostError if that is not the present lease."""
        with self._lock:
            self._finish(self.require(device, token, owner), "it was released")

    def disarm_all(self) -> None:
        for lease in self._active.values():
            lease.is_armed = False

    def find(self, identifier: str) -> Lease | None:
        return next((lease for lease in self.active() if lease.id == identifier), None)

    def require(self, device: str, token: str, owner: str) -> Lease:
        """The present lease of an arm, if it is the one that is shown. Raises LeaseLostError if it is not."""
        lease = self._present(device)
        shown = token.encode("utf-8", "surrogatepass")
        if lease is None or not hmac.compare_digest(shown, lease.token.encode()) or owner != lease.owner:
            now = "nobody has it" if lease is None else f"{lease.holder} has it by lease {lease.number}"
            raise LeaseLostError(f"{device}: the lease that was shown does not hold, {now}; take a new one")
        return lease

    def permit(self, device: str, token: str | None, owner: str, *, is_needed: bool) -> Permit:
        """Leave to move an arm. Raises LeaseError if there is no such leave."""
        if token is not None:
            permit: Permit = LeasePermit(self.require(device, token, owner), self.find_end_reason)
        elif is_needed:
            hint = "POST /api/v1/leases, arm the lease, and send its token as header Lease-Token"
            raise LeaseNeededError(f"{device}: moves for whoever has its lease; {hint}")
        else:
            # By the claim of the arm alone, which cannot be leased while that lasts.
            permit = Permit(partial(self.require_unleased, device))
        permit.require()
        return permit

    def find_end_reason(self, lease: Lease) -> str | None:
        """Why a lease does not hold; None while it does. Takes no lock."""
        if lease.lost is None and self._clock() >= lease.ends:
            self._finish(lease, f"no sign of life for {lease.ttl_s:g} s")
        return lease.lost

    def require_unleased(self, device: str) -> None:
        present = self._present(device)
        if present is not None:
            raise self._refuse_leased(present)

    def _present(self, device: str) -> Lease | None:
        lease = self._active.get(device)
        return None if lease is None or self.find_end_reason(lease) is not None else lease

    def _finish(self, lease: Lease, why: str) -> None:
        if lease.lost is None:
            lease.lost = why
            lease.is_armed = False
            self._on_end(lease, why)

    def _refuse_leased(self, lease: Lease) -> LeasedError:
        left = self.seconds_left(lease)
        return LeasedError(f"{lease.device}: {lease.holder} has its lease, for {left:.1f} s more unless it is renewed")
