"""Process data: frames of several objects, where a drive keeps what they are, and which of its PDOs are used."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from tauscope_drivers.canopen import objects
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
    """Payload of a frame. Raises OverflowError, never cuts to size: a target that wraps or saturates is full torque."""
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


@dataclass(frozen=True)
class PdoParameters:
    """Where a drive keeps what one of its PDOs is."""

    identifier: DriveObject
    kind: DriveObject
    count: DriveObject
    entries: tuple[DriveObject, ...]


@dataclass(frozen=True)
class PdoDirection:
    """Where CiA 301 has the parameters of PDOs that go one way, and their identifiers by its default connection set."""

    communication: int
    mapping: int
    first_identifier: int

    def identifier(self, number: int, node_id: int) -> int:
        """Identifier of a PDO. `number`: from 0."""
        return self.first_identifier + 0x100 * number + node_id

    def parameters(self, number: int, entries: int) -> PdoParameters:
        """Parameters of a PDO. `number`: from 0; `entries`: objects that it holds."""
        communication, mapping = self.communication + number, self.mapping + number
        return PdoParameters(
            identifier=DriveObject("PDO COB-ID", communication, 1, 32),
            kind=DriveObject("PDO transmission type", communication, 2, 8),
            count=DriveObject("PDO number of entries", mapping, 0, 8),
            entries=tuple(DriveObject("PDO entry", mapping, subindex, 32) for subindex in range(1, entries + 1)),
        )


RECEIVED = PdoDirection(0x1400, 0x1600, 0x200)  # by the drive: targets
SENT = PdoDirection(0x1800, 0x1A00, 0x180)  # by the drive: measurements

PDO_COUNT = 4  # PDOs with an identifier of their own by CiA 301's default connection set

MEASURED = (objects.STATUSWORD, objects.TORQUE_ACTUAL, objects.POSITION_ACTUAL)
MEASURED_WHERE_THERE = (objects.VELOCITY_ACTUAL, objects.ERROR_CODE)

_FRAME_BITS = 64
_KNOWN = {
    entry.mapping: entry
    for entry in (
        *(*MEASURED, *MEASURED_WHERE_THERE, objects.CONTROLWORD, objects.MODE_OF_OPERATION, objects.MODE_DISPLAY),
        *(objects.TARGET_POSITION, objects.TARGET_TORQUE, objects.INTERPOLATION_DATA, objects.LARGEST_TORQUE),
    )
}


@dataclass(frozen=True)
class PdoSlot:
    """A PDO that a drive has."""

    number: int  # from 0
    fixed: tuple[DriveObject, ...] | None = None  # its objects, where its mapping cannot be written; None where it can
    entries: int = 8  # most objects that it takes


@dataclass(frozen=True)
class Pdo:
    """A PDO as it is used."""

    direction: PdoDirection
    number: int
    layout: PdoLayout
    is_fixed: bool = False

    def identifier(self, node_id: int) -> int:
        """Of its frames."""
        return self.direction.identifier(self.number, node_id)


@dataclass(frozen=True)
class PdoPlan:
    """All PDOs of a drive that are used."""

    received: tuple[Pdo, ...]
    sent: tuple[Pdo, ...]
    missing: tuple[DriveObject, ...] = ()  # needed, and in none of them


@dataclass(frozen=True)
class PdoSlots:
    """The PDOs of a drive; all that the driver needs are free where nobody knows."""

    received: tuple[PdoSlot, ...] = (PdoSlot(0),)
    sent: tuple[PdoSlot, ...] = (PdoSlot(0), PdoSlot(1))


def plan_pdos(slots: PdoSlots, target: DriveObject, optional: Iterable[DriveObject]) -> PdoPlan:
    """PDOs for a target and for all measurements. `optional`: measurements that the drive has beside those needed."""
    received, not_received = _assign(RECEIVED, slots.received, (objects.CONTROLWORD, target), ())
    sent, not_sent = _assign(SENT, slots.sent, MEASURED, tuple(optional))
    return PdoPlan(received, sent, (*not_received, *not_sent))


def decode_mapping(entries: Sequence[int]) -> tuple[DriveObject, ...] | None:
    """Objects of a mapping parameter's entries; None where they are no frame of whole bytes."""
    found = tuple(
        _KNOWN.get(entry) or DriveObject("Mapped object", entry >> 16, entry >> 8 & 0xFF, entry & 0xFF)
        for entry in entries
    )
    sizes = [one.bits for one in found]
    return found if sum(sizes) <= _FRAME_BITS and all(bits and bits % 8 == 0 for bits in sizes) else None


def _assign(
    direction: PdoDirection, slots: Sequence[PdoSlot], needed: Sequence[DriveObject], optional: Sequence[DriveObject]
) -> tuple[tuple[Pdo, ...], tuple[DriveObject, ...]]:
    """PDOs that hold all objects, and the needed ones that are left over: fixed PDOs are used first."""
    left = [*needed, *optional]
    used: list[Pdo] = []
    fixed = {slot.number: slot.fixed for slot in slots if slot.fixed}
    while fixed:
        number = max(fixed, key=lambda number: (len(set(left) & set(fixed[number])), -number))
        held = fixed.pop(number)
        if not set(left) & set(held):
            break
        used.append(Pdo(direction, number, PdoLayout(held), is_fixed=True))
        left = [entry for entry in left if entry not in held]
    for slot in slots:
        if slot.fixed is None and left:
            content = _fill(left, slot.entries)
            used.append(Pdo(direction, slot.number, PdoLayout(content)))
            left = [entry for entry in left if entry not in content]
    return tuple(sorted(used, key=lambda one: one.number)), tuple(entry for entry in needed if entry in left)


def _fill(wanted: Sequence[DriveObject], most: int) -> tuple[DriveObject, ...]:
    """The first objects that fit into a frame together."""
    content: list[DriveObject] = []
    for entry in wanted:
        if len(content) < most and sum(one.bits for one in content) + entry.bits <= _FRAME_BITS:
            content.append(entry)
    return tuple(content)


LARGEST_LOAD = 0.8  # share of the bus that cyclic frames may take; the rest is for heartbeats, emergencies and SDOs

# characters of an 8-byte frame in the serial-line CAN protocol (slcan): ``t`` + 3 + 1 + 16 + return
ASCII_FRAME_BYTES = 22
HIGHEST_BIT_RATE = 1e6  # of classical CAN [bit/s]


def frame_bits(payload_bytes: int) -> int:
    """Longest standard data frame: 47 + 8 d + ⌊(34 + 8 d − 1)/4⌋ bits, space between frames included; d bytes."""
    return 47 + 8 * payload_bytes + (34 + 8 * payload_bytes - 1) // 4


def cycle_bits(nodes: int, payloads: Sequence[int]) -> int:
    """Bits of one cycle: SYNC and every node's PDOs. `payloads`: of the PDOs of one node [bytes]."""
    return frame_bits(0) + nodes * sum(map(frame_bits, payloads))


def largest_rate_hz(nodes: int, payloads: Sequence[int], bit_rate: float, serial_baud: float | None = None) -> float:
    """Most cycles a second of bus and serial line [Hz]. `payloads`: of a node's PDOs [bytes]."""
    bus_s = cycle_bits(nodes, payloads) / (LARGEST_LOAD * bit_rate)
    return 1.0 / max(bus_s, _serial_s(nodes, payloads, serial_baud))


def rate_limit(nodes: int, payloads: Sequence[int], bit_rate: float, serial_baud: float | None = None) -> str:
    """What limits the rate, the bus or the adapter's serial line, and what to do; arguments as of `largest_rate_hz`."""
    bus_s = cycle_bits(nodes, payloads) / bit_rate
    serial_s = _serial_s(nodes, payloads, serial_baud)
    if serial_s > bus_s / LARGEST_LOAD:
        line = f"the adapter's serial line of {serial_baud:g} baud"
        return f"{line} takes {serial_s * 1e3:.2f} ms of each cycle, use a faster adapter"
    bus = f"the frames of {nodes} drives take {bus_s * 1e3:.2f} ms of each cycle at {bit_rate / 1e3:g} kbit/s"
    remedy = ", use a higher bit rate" if bit_rate < HIGHEST_BIT_RATE else ""
    return f"{bus}, and {100 * (1 - LARGEST_LOAD):.0f} % of the bus are kept free{remedy}"


def _serial_s(nodes: int, payloads: Sequence[int], serial_baud: float | None) -> float:
    frames = 1 + nodes * len(payloads)
    return 0.0 if serial_baud is None else frames * ASCII_FRAME_BYTES * 10.0 / serial_baud
