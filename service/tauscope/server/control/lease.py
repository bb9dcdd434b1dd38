"""One lease: who may move which arm, until when, under which number."""

from dataclasses import dataclass

LONGEST_TTL_S = 60.0
"""Longest time for which a lease may be given without a sign of life [s]."""


@dataclass(eq=False)
class Lease:
    """One lease.

    Attributes are replaced one at a time and never need a lock to be read.

    ttl_s : float
        how long it lasts without a sign of life [s]
    ends : float
        when it ends, on the clock of `Leases` [s]
    """

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
        """What its holder shows."""
        return f"{self.number}-{self.secret}"
