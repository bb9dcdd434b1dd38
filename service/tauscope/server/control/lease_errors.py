"""Why an arm may not be taken, kept or moved."""

from tauscope.errors import AcquisitionError


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
