"""Leave to move an arm as leases give it: by a lease that is shown, or for one motion where nobody has one."""

from collections.abc import Callable

from tauscope.robot.messages import one_line
from tauscope.server.control.lease import Lease
from tauscope.server.control.lease_errors import LeaseLostError, NotArmedError
from tauscope.server.control.permits import FREE


class LeasePermit:
    """Leave by a lease that was shown."""

    def __init__(self, lease: Lease, end_of: Callable[[Lease], str | None]) -> None:
        """Nothing is asked yet."""
        self._lease, self._end_of = lease, end_of

    def require(self) -> None:
        """Refuse what its end would stop at once."""
        lost = self._end_of(self._lease)
        if lost is not None:
            raise LeaseLostError(one_line(f"{self._lease.device}: lease {self._lease.number} ended: {lost}"))
        if not self._lease.is_armed:
            hint = f"POST /api/v1/leases/{self._lease.id}/arm first"
            raise NotArmedError(one_line(f"{self._lease.device}: its lease is not armed; {hint}"))

    def end(self) -> str | None:
        """Why the motion has to end."""
        lost = self._end_of(self._lease)
        if lost is not None:
            return f"lease {self._lease.number} of {self._lease.holder} ended: {lost}"
        return None if self._lease.is_armed else f"lease {self._lease.number} of {self._lease.holder} was disarmed"

    def stopped(self) -> None:
        """A stop disarms."""
        self._lease.is_armed = False


class UnleasedPermit:
    """Leave for one motion, by the arm's claim alone; nobody can lease the arm while it lasts."""

    def __init__(self, device: str, require_unleased: Callable[[str], None]) -> None:
        """Nothing is asked yet."""
        self._device, self._require_unleased = device, require_unleased

    def require(self) -> None:
        """Refuse an arm that is leased."""
        self._require_unleased(self._device)

    def end(self) -> str | None:
        """The motion may go on."""
        return FREE.end()

    def stopped(self) -> None:
        """Nothing to take back."""
