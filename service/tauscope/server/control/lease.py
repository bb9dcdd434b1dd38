"""One lease: who may move which arm, until when, under which number."""

from dataclasses import dataclass

LONGEST_TTL_S = 60.0
"""Longest time for which a lease may be given without a sign of life [s]."""


@dataclass(eq=False)
class Lease:
    """One lease.

    Attributes are replaced one at a time and never need a lock to be read.

    id : str
        public name
    number : int
        for fencing: a later lease has a higher one
    device : str
        the arm
    holder : str
        who has it, in words
    owner : str
        whose it is: no other caller can use its token
    ttl_s : float
        how long it lasts without a sign of life [s]
    secret : str
        second part of the token
    ends : float
        when it ends, on the clock of `Leases` [s]
    is_armed : bool
        whether the arm may move
    lost : str or None
        why it does not hold any more; None while it does
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
