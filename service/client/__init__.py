"""The service's interface for Python programs: typed answers, leases that keep themselves, nothing beyond HTTP."""

from service.client.client import Client
from service.client.held_lease import HeldLease
from service.client.transport import ApiError

__all__ = ["ApiError", "Client", "HeldLease"]
