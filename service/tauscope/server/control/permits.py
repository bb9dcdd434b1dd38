"""What allows an arm to move: asked before a motion begins, and again and again while it lasts."""

from typing import Protocol


class Permit(Protocol):
    """Somebody's leave to move one arm. Every method takes no lock, touches no disk and returns at once."""

    def require(self) -> None:
        """Refuse a motion that may not begin.

        Raises
        ------
        LeaseError
            if it may not
        """
        ...

    def end(self) -> str | None:
        """Why the motion may not go on; None while it may."""
        ...

    def stopped(self) -> None:
        """Somebody stopped the arm: before it moves again, it has to be armed again."""
        ...


class FreePermit:
    """Leave to move an arm that nobody has a lease of, where no lease is asked for."""

    def require(self) -> None:
        """Nothing to refuse."""

    def end(self) -> str | None:
        """The motion may go on."""
        return None

    def stopped(self) -> None:
        """Nothing to take back."""


FREE = FreePermit()
"""Leave that is never taken back."""
