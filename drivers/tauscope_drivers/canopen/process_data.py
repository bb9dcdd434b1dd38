"""Process data: frames of several objects, which of them the driver uses, and where a drive keeps that."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from tauscope_drivers.canopen.objects import DriveObject


@dataclass(frozen=True)
class PdoLayout:
    """Which objects a process data object holds, in their order."""

    objects: tuple[DriveObject, ...]

    def __post_init__(self) -> None:
        """A CAN frame holds eight bytes, and all entries here are whole ones."""
        bits = sum(entry.bits for entry in self.objects)
        if bits > 64 or any(entry.bits % 8 for entry in self.objects):
            raise ValueError(f"a PDO of {bits} bits does not fit into a frame of whole bytes up to 64 bits")

    @cached_property
    def size(self) -> int:
        """Payload of the frame [bytes]."""
        return sum(entry.bits for entry in self.objects) // 8


def encode_pdo(layout: PdoLayout, values: Mapping[DriveObject, int]) -> bytes:
    """Payload of a frame.

    A value that its object cannot hold is an error and never cut to size: a target that wraps round or saturates is
    full torque. Raises OverflowError where a value does not fit its object; names the object.
    """
    payload = bytearray()
    for entry in layout.objects:
        try:
            payload += values[entry].to_bytes(entry.bits // 8, "little", signed=entry.signed)
        except OverflowError:
            raise OverflowError(f"{entry}: {values[entry]} does not fit {entry.bits} bits") from None
    return bytes(payload)


def decode_pdo(layout: PdoLayout, payload: bytes) -> dict[DriveObject, int] | None:
    """Values of a frame; None where its length is not the layout's, which a wrongly mapped drive sends."""
    if len(payload) != layout.size:
        return None
    values, start = {}, 0
    for entry in layout.objects:
        stop = start + entry.bits // 8
        values[entry] = int.from_bytes(payload[start:stop], "little", signed=entry.signed)
        start = stop
    return values


def mapping_entries(objects: Sequence[DriveObject]) -> list[int]:
    """What the mapping parameter's subindices 1, 2, … hold."""
    return [entry.mapping for entry in objects]


RECEIVED_ID = 0x200
SENT_ID = 0x180
"""Identifiers of the first PDOs of node 0, by CiA 301's default connection set."""


@dataclass(frozen=True)
class PdoParameters:
    """Where a drive keeps what one of its PDOs is."""

    identifier: DriveObject
    kind: DriveObject
    count: DriveObject
    entries: tuple[DriveObject, ...]


def received_parameters(number: int, entries: int) -> PdoParameters:
    """Parameters of a PDO with targets. `number`: from 0; `entries`: objects that it holds."""
    return _parameters(0x1400 + number, 0x1600 + number, entries)


def sent_parameters(number: int, entries: int) -> PdoParameters:
    """Parameters of a PDO with measurements. `number`: from 0; `entries`: objects that it holds."""
    return _parameters(0x1800 + number, 0x1A00 + number, entries)


def _parameters(communication: int, mapping: int, entries: int) -> PdoParameters:
    """Communication and mapping parameter, CiA 301."""
    return PdoParameters(
        identifier=DriveObject("PDO COB-ID", communication, 1, 32),
        kind=DriveObject("PDO transmission type", communication, 2, 8),
        count=DriveObject("PDO number of entries", mapping, 0, 8),
        entries=tuple(DriveObject("PDO entry", mapping, subindex, 32) for subindex in range(1, entries + 1)),
    )
