"""What the server runs: anything that takes bytes of a master, lets time pass, and answers."""

from typing import Any, Protocol


class Emulator(Protocol):
    """Devices on one bus with the arm that they move; the instants are those of the server's clock."""

    @property
    def now_s(self) -> float:
        """Instant up to which the devices have come [s]."""
        ...

    @property
    def next_due_s(self) -> float:
        """When the next bytes reach the master; infinite where none are under way [s]."""
        ...

    def hears(self, baud: int) -> bool:
        """Whether a master that has set this baud rate is understood.

        Parameters
        ----------
        baud : int
            of the master's port [bit/s]
        """
        ...

    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes of the master.

        Parameters
        ----------
        data : bytes
            as they came
        now_s : float
            when [s]
        """
        ...

    def advance_to(self, now_s: float) -> None:
        """Let time pass.

        Parameters
        ----------
        now_s : float
            present instant [s]
        """
        ...

    def due(self, now_s: float) -> bytes:
        """Bytes that have reached the master by now.

        Parameters
        ----------
        now_s : float
            present instant [s]
        """
        ...

    def describe(self) -> dict[str, Any]:
        """What the devices are doing, as plain data."""
        ...

    def answer(self, request: dict[str, Any]) -> dict[str, int] | None:
        """Do what a test asks; returns ``{"value": …}`` where it asks for one.

        Parameters
        ----------
        request : dict
            plain data
        """
        ...


class EmulatorOrder(Protocol):
    """What the server needs of the order that started it."""

    @property
    def port(self) -> str:
        """Where the name of the pseudo terminal is linked to."""
        ...

    @property
    def control(self) -> str:
        """Unix socket for the test."""
        ...

    @property
    def trace(self) -> str | None:
        """File that what the devices do is appended to."""
        ...

    def to_json(self) -> str:
        """The order as text, which the process is started with."""
        ...

    def build(self, now_s: float) -> Emulator:
        """The emulator.

        Parameters
        ----------
        now_s : float
            present instant [s]
        """
        ...
