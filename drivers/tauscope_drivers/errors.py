"""What a backend raises, and how it describes a fault of a drive."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Self


@dataclass(frozen=True)
class Fault:
    """A fault that a drive or the bus reports, decoded."""

    code: str
    joint: int | None  # joint number, counted from 1; None where it concerns the whole arm
    detail: str
    remedy: str

    def __str__(self) -> str:
        place = "arm" if self.joint is None else f"joint {self.joint}"
        return f"{place}: {self.detail} ({self.code}); {self.remedy}"


def decode_bits(
    bits: Sequence[tuple[int, str, str, str]], register: int, joint: int, name: str, unknown_remedy: str
) -> tuple[Fault, ...]:
    """Faults of a register; empty for 0. `bits`: each with code, meaning and remedy; `joint`: from 1."""
    stated = f"{name} 0x{register:02X}"
    found = tuple(
        Fault(code, joint, f"{meaning}, {stated}", remedy) for bit, code, meaning, remedy in bits if register & bit
    )
    return found or (() if not register else (Fault("drive", joint, stated, unknown_remedy),))


HOST_REMEDY = "make sure the host runs, then acknowledge"  # of a host that fell silent


class DriverErrorKind(StrEnum):
    """What went wrong, in the words that callers decide by."""

    NOT_CONNECTED = "not-connected"
    CANNOT_CONNECT = "cannot-connect"
    NOT_ENABLED = "not-enabled"
    REFUSED = "refused"
    FAULT = "fault"
    LOST = "lost"


class DriverError(RuntimeError):
    """A backend cannot do what it was asked for; nothing moves because of the request."""

    def __init__(self, kind: DriverErrorKind, message: str, faults: tuple[Fault, ...] = ()) -> None:
        super().__init__(message)
        self.kind = kind
        self.faults = faults

    @classmethod
    def refusal(cls, message: str) -> Self:
        """``refused``: what was asked for cannot be done, or may not be."""
        return cls(DriverErrorKind.REFUSED, message)

    @classmethod
    def no_connection(cls, message: str, faults: tuple[Fault, ...] = ()) -> Self:
        """``cannot-connect``: a device is missing, taken or of the wrong kind."""
        return cls(DriverErrorKind.CANNOT_CONNECT, message, faults)
