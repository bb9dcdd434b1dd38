"""What the server runs: anything that takes bytes of a master, lets time pass, and answers; and its clock."""

from collections.abc import Callable
from math import ceil
from typing import Any, ClassVar, Protocol

STEP_S = 1e-3
"""Period of the devices' own loops and of the physics [s]."""

MOST_STEPS = 10
"""Steps that are taken in a row while nothing is asked."""

LONGEST_CATCH_UP_S = 0.25
"""Where the machine stood still for longer than this, the device's clock has lost the rest [s]."""

ALL_STEPS = ceil(LONGEST_CATCH_UP_S / STEP_S)
"""As many as can be due."""


class DeviceClock:
    """How far devices have come; what a machine that stood still made them miss is lost, and told.

    `lost_s`: time that was never stepped through [s].
    """

    def __init__(self, now_s: float) -> None:
        """Begin. `now_s`: present instant [s]."""
        self.tick = round(now_s / STEP_S)
        self.lost_s = 0.0

    @property
    def now_s(self) -> float:
        """Instant up to which the devices have come [s]."""
        return self.tick * STEP_S + self.lost_s

    def catch_up(self, now_s: float, step: Callable[[], None], most_steps: int = MOST_STEPS) -> None:
        """Take the steps that are due: not all at once where there are many, so that a master is heard in between.

        `now_s`: present instant [s].
        """
        if now_s - self.now_s > LONGEST_CATCH_UP_S:
            self.lost_s += now_s - self.now_s - LONGEST_CATCH_UP_S
        for _ in range(most_steps):
            if self.now_s + STEP_S > now_s:
                return
            self.tick += 1
            step()


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
        """Whether a master that has set this baud rate is understood. `baud`: of the master's port [bit/s]."""
        ...

    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes of the master. `now_s`: when [s]."""
        ...

    def advance_to(self, now_s: float, most_steps: int = MOST_STEPS) -> None:
        """Let time pass: not all at once where the machine stood still, so that the master is heard in between.

        `now_s`: present instant [s].
        """
        ...

    def due(self, now_s: float) -> bytes:
        """Bytes that have reached the master by now. `now_s`: present instant [s]."""
        ...

    def describe(self) -> dict[str, Any]:
        """What the devices are doing, as plain data."""
        ...

    def answer(self, request: dict[str, Any]) -> dict[str, int] | None:
        """Do what a test asks; returns ``{"value": …}`` where it asks for one."""
        ...


class Port(Protocol):
    """The devices' end of what a master opens."""

    @property
    def baud(self) -> int:
        """What the master has set, or a rate that is understood where there is none to set [bit/s]."""
        ...

    def fileno(self) -> int:
        """Descriptor to wait on."""
        ...

    def read(self) -> bytes | None:
        """What a master sent; None where no master has it open."""
        ...

    def write(self, data: bytes) -> None:
        """Send to the master; lost where there is none, or where it reads nothing."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


class EmulatorOrder(Protocol):
    """What the server needs of the order that started it."""

    module: ClassVar[str]
    """What runs as the process: the package of the bus."""

    @property
    def control(self) -> str:
        """Unix socket for the test."""
        ...

    @property
    def trace(self) -> str | None:
        """File that what the devices do is appended to."""
        ...

    @property
    def stepped(self) -> bool:
        """Whether time passes only when a test says so; else it is the machine's."""
        ...

    def to_json(self) -> str:
        """The order as text, which the process is started with."""
        ...

    def open_port(self) -> Port:
        """What the master opens."""
        ...

    def build(self, now_s: float) -> Emulator:
        """The emulator. `now_s`: present instant [s]."""
        ...
