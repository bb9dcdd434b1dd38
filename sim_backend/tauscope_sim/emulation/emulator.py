"""What the server runs: emulated devices with their clock and their port, and the order that starts them."""

import contextlib
import errno
import fcntl
import json
import os
import struct
import tty
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import ceil
from typing import Any, Protocol, Self

import numpy as np

from tauscope.robot.robot import Array
from tauscope_sim.emulation.fault_kit import InjectedFault, TimedQueue, faults_from

STEP_S = 1e-3  # period of the devices' own loops and of the physics [s]
MOST_STEPS = 10  # steps that are taken in a row while nothing is asked

# where the machine stood still for longer than this, the device's clock has lost the rest [s]
LONGEST_CATCH_UP_S = 0.25
ALL_STEPS = ceil(LONGEST_CATCH_UP_S / STEP_S)  # as many as can be due


class DeviceClock:
    """How far devices have come. `lost_s`: never stepped through, for the machine stood still; it is told [s]."""

    def __init__(self, now_s: float) -> None:
        self.tick = round(now_s / STEP_S)
        self.lost_s = 0.0

    @property
    def now_s(self) -> float:
        """Instant up to which the devices have come [s]."""
        return self.tick * STEP_S + self.lost_s

    def catch_up(self, now_s: float, step: Callable[[], None], most_steps: int = MOST_STEPS) -> None:
        """Take the steps that are due: not all at once where there are many, so that a master is heard in between."""
        if now_s - self.now_s > LONGEST_CATCH_UP_S:
            self.lost_s += now_s - self.now_s - LONGEST_CATCH_UP_S
        for _ in range(most_steps):
            if self.now_s + STEP_S > now_s:
                return
            self.tick += 1
            step()


class MovedArm(Protocol):
    """What devices move; it stands on a stand until all of them have had torque once."""

    stands_on_stand: bool

    @property
    def motion(self) -> tuple[Array, Array]:
        """Position and velocity of the motors, in joint units, each (n,)."""
        ...


class Emulator(ABC):
    """Devices on one bus with the arm that they move; the instants are those of the server's clock."""

    def __init__(self, arm: MovedArm, now_s: float) -> None:
        """Everything at rest."""
        self.arm = arm
        self.schedule = TimedQueue[InjectedFault]()
        self._clock = DeviceClock(now_s)

    @property
    def now_s(self) -> float:
        """Instant up to which the devices have come [s]."""
        return self._clock.now_s

    @property
    @abstractmethod
    def next_due_s(self) -> float:
        """When the next bytes reach the master; infinite where none are under way [s]."""

    @abstractmethod
    def hears(self, baud: int) -> bool:
        """Whether a master that has set this baud rate is understood. `baud`: of the master's port [bit/s]."""

    @abstractmethod
    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes of the master."""

    def advance_to(self, now_s: float, most_steps: int = MOST_STEPS) -> None:
        """Let time pass: not all at once where the machine stood still, so that the master is heard in between."""
        self._clock.catch_up(now_s, self._step, most_steps)

    @abstractmethod
    def due(self, now_s: float) -> bytes:
        """Bytes that have reached the master by now."""

    def describe(self) -> dict[str, Any]:
        """What the devices are doing, as plain data."""
        position, velocity = map(np.ndarray.tolist, self.arm.motion)
        on_stand, lost = self.arm.stands_on_stand, self._clock.lost_s
        return {"time": self.now_s, "position": position, "velocity": velocity, "on_stand": on_stand, "lost": lost}

    def answer(self, request: dict[str, Any]) -> dict[str, int] | None:
        """Do what a test asks.

        `request`: ``{"inject": [fault, …]}``, ``{"get": [device, place]}``, ``{"put": [device, place, value]}``,
        ``{"stand": bool}`` (put the stand under it, or take it away), or nothing of these. A place is an item's name,
        or index and subindex.
        """
        if "inject" in request:
            self.inject(faults_from(request["inject"], self.now_s))
        elif "get" in request:
            return {"value": self.get(*request["get"])}
        elif "put" in request:
            self.put(*request["put"])
        elif "stand" in request:
            self.arm.stands_on_stand = request["stand"]
        return None

    def inject(self, faults: list[InjectedFault]) -> None:
        """Plan faults, and carry out those that are due."""
        for fault in faults:
            self.schedule.put(fault.at_s, fault)
        self._run_faults()

    def _run_faults(self) -> None:
        for fault in self.schedule.take_due(self.now_s):
            self._carry_out(fault)

    @abstractmethod
    def _carry_out(self, fault: InjectedFault) -> None:
        """Let a fault happen now."""

    @abstractmethod
    def get(self, device: int, place: Any) -> int:
        """What a device holds."""

    @abstractmethod
    def put(self, device: int, place: Any, value: int) -> None:
        """Set what a device holds, behind the master's back."""

    @abstractmethod
    def _step(self) -> None:
        """One period of the devices' loops."""


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

    def write(self, data: bytes) -> None:
        """Send to the master; lost where there is none, or where it reads nothing."""

    def close(self) -> None:
        """Hang up."""


_TCGETS2 = 0x802C542A
_TERMIOS2 = "=4I20B2I"


class PseudoTerminal:
    """The near end, a `Port`; a master opens the far end, which is not kept open here, by the name linked to it."""

    def __init__(self, link: str) -> None:
        self._near, far = os.openpty()
        tty.setraw(far)
        self._link = link
        temporary = f"{link}.{os.getpid()}"
        os.symlink(os.ttyname(far), temporary)
        os.replace(temporary, link)
        os.close(far)
        os.set_blocking(self._near, False)

    def fileno(self) -> int:
        """Descriptor to wait on."""
        return self._near

    def read(self) -> bytes | None:
        """What a master sent; None where no master has it open."""
        try:
            return os.read(self._near, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno == errno.EIO:
                return None
            raise

    def write(self, data: bytes) -> None:
        """Send to the master; lost where there is none, or where it reads nothing."""
        with contextlib.suppress(BlockingIOError, OSError):
            os.write(self._near, data)

    @property
    def baud(self) -> int:
        """What the master has set [bit/s]."""
        settings = fcntl.ioctl(self._near, _TCGETS2, bytes(struct.calcsize(_TERMIOS2)))
        return struct.unpack(_TERMIOS2, settings)[-1]

    def close(self) -> None:
        """Hang up."""
        os.close(self._near)
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._link)


@dataclass(frozen=True, kw_only=True)
class EmulatorOrder(ABC):
    """The order that starts an emulator process; JSON can hold it."""

    start: tuple[float, ...]  # where the joints stand [rad or m]
    port: str  # what the master opens
    control: str  # Unix socket for the test
    scenario: str | None = None
    stepped: bool = False  # whether time passes only when a test says so; else it is the machine's
    trace: str | None = None  # file that what the devices do is appended to

    @property
    def kind(self) -> str:
        """Module and name of the order, by which the process finds it."""
        return f"{type(self).__module__}:{type(self).__qualname__}"

    def to_json(self) -> str:
        """The order as text, which the process is started with."""
        return json.dumps(vars(self), default=asdict)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The order in a text."""
        document = json.loads(text)
        fields: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in document.items()
        }
        return cls(**fields)

    def open_port(self) -> Port:
        """What the master opens: a pseudo terminal."""
        return PseudoTerminal(self.port)

    @abstractmethod
    def build(self, now_s: float) -> Emulator:
        """The emulator."""
