"""What can be said of a bus without moving anything on it: findings, devices, and the frames that would be sent."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.backend import ControlMode, DriveLimits


class Severity(StrEnum):
    """How much a finding matters."""

    GOOD = "good"
    WARNING = "warning"
    FAILURE = "failure"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    severity: Severity
    subject: str
    detail: str
    remedy: str = ""


@dataclass(frozen=True)
class FoundDevice:
    """A device that answered on a bus."""

    address: int
    bit_rate: int
    model: str
    firmware: str = ""


@dataclass(frozen=True, eq=False)
class FrameRequest:
    """The run whose frames are asked for. `targets`: (K, n), of K cycles; the arm stands at the first [rad or m]."""

    mode: ControlMode
    limits: DriveLimits
    watchdog_s: float
    targets: NDArray[np.float64]
    cycle_s: float | None = None


@dataclass(frozen=True)
class PlannedFrame:
    """A frame that would be sent."""

    phase: str
    meaning: str
    wire: str  # as the bus's own tools write it: bytes in hexadecimal on a serial bus, ``201#0F00`` on CAN

    @staticmethod
    def on_serial_bus(phase: str, meaning: str, frame: bytes) -> "PlannedFrame":
        """A frame of bytes."""
        return PlannedFrame(phase, meaning, frame.hex(" ").upper())


PHASES = ("connect", "enable", "cycle", "stop")  # in the order in which a run goes through them


def failure(place: str, message: str, device: str = "") -> Finding:
    """A failure by a driver's message, without the place at its beginning: that stands before it."""
    for name in filter(None, (place, device)):
        message = message.removeprefix(f"{name}: ").removeprefix(f"{name} ")
    detail, _, remedy = message.rpartition("; ")  # what follows the last semicolon is what to do
    return Finding(Severity.FAILURE, place, detail or message, remedy if detail else "see the message")
