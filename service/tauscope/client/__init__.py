"""The service's interface for Python programs: typed answers, leases that keep themselves, nothing beyond HTTP."""

from tauscope.client.client import Client, HeldLease
from tauscope.client.transport import ApiError

__all__ = ["ApiError", "Client", "HeldLease"]
