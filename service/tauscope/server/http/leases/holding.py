"""The lease that comes with a request."""

from typing import Annotated

from fastapi import Header, Request

from tauscope.server.auth.gate import caller_of
from tauscope.server.control.leases import Permit
from tauscope.server.http.services import Services

LEASE_TOKEN = "Lease-Token"  # noqa: S105 - name of a header

LeaseToken = Annotated[
    str | None,
    Header(
        alias=LEASE_TOKEN,
        max_length=200,
        description="token of the arm's lease; a service without API keys asks for none unless somebody has a lease",
    ),
]


def owner_of(request: Request) -> str:
    """Whose a lease is that this request takes or uses."""
    return caller_of(request.scope).key or "local"


def permit_of(request: Request, services: Services, device: str) -> Permit:
    """Leave to move an arm, by the lease that comes with a request.

    Raises
    ------
    LeaseError
        if there is no such leave
    """
    is_needed = services.settings.require_lease or caller_of(request.scope).key is not None
    return services.leases.permit(device, request.headers.get(LEASE_TOKEN), owner_of(request), is_needed=is_needed)
