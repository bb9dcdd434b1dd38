"""Mapping a drive's PDOs; one whose mapping it does not let change is used as it is."""

from dataclasses import replace

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.canopen.process_data import (
    PDO_COUNT,
    Pdo,
    PdoParameters,
    PdoPlan,
    PdoSlot,
    PdoSlots,
    decode_mapping,
    mapping_entries,
    received_identifier,
    received_parameters,
    sent_identifier,
    sent_parameters,
)
from tauscope_drivers.errors import DriverError, DriverErrorKind

_PDO_OFF = 1 << 31
_IDENTIFIER = 0x7FF
_EVERY_SYNC = 1
_LAST_SYNCHRONOUS = 240
_LONGEST_MAPPING = 8
_MAPPINGS = 2  # what is not kept the first time may have been altered on its way

_COMMANDED = {objects.CONTROLWORD, objects.TARGET_POSITION, objects.TARGET_TORQUE, objects.INTERPOLATION_DATA}


def map_process_data(node: DriveNode, mode: ControlMode) -> None:
    """Write the parameters of all PDOs that a mode needs, by explicit SDOs, and listen to them.

    Raises DriverError ``refused`` where a needed object is in none of its PDOs, or a PDO is not exchanged at SYNC.
    """
    for _ in range(2 * PDO_COUNT + 1):
        plan = node.plan_for(mode)
        _require_complete(node, plan)
        if all(_write_pdo(node, pdo, is_sent=is_sent) for pdo, is_sent in _directions(plan)):
            break
    else:
        raise DriverError.refusal(f"{node.place}: its PDO mapping reads differently each time; check the wiring")
    node.use_plan(plan)
    unknown = {entry for pdo in plan.received for entry in pdo.layout.objects} - _COMMANDED
    # a frame of fixed mapping holds other objects as well: they keep the values that they have
    node.held = {entry: _read_held(node, entry) for entry in unknown} | dict.fromkeys(_COMMANDED, 0)


def _read_held(node: DriveNode, entry: DriveObject) -> int:
    """Value of another object of an RPDO; a place that is only kept free has none."""
    return 0 if entry.index < 0x1000 else node.dictionary.read(entry)


def _directions(plan: PdoPlan) -> list[tuple[Pdo, bool]]:
    return [*((pdo, False) for pdo in plan.received), *((pdo, True) for pdo in plan.sent)]


def _require_complete(node: DriveNode, plan: PdoPlan) -> None:
    if plan.missing:
        raise DriverError.refusal(
            f"{node.place}: {plan.missing[0]} is in none of its PDOs, and their mapping is fixed; "
            "map it with the maker's tool, or use another drive"
        )


def _write_pdo(node: DriveNode, pdo: Pdo, *, is_sent: bool) -> bool:
    """Set up one PDO; False where its mapping cannot be written, and is known as fixed from now on."""
    entries = len(pdo.layout.objects)
    places = sent_parameters(pdo.number, entries) if is_sent else received_parameters(pdo.number, entries)
    identify = sent_identifier if is_sent else received_identifier
    identifier = identify(pdo.number, node.configuration.node_id)
    wanted = mapping_entries(pdo.layout.objects)
    if pdo.is_fixed:
        if read_mapping(node, places) != wanted:
            _learn(node, pdo.number, places, is_sent=is_sent)
            return False
        _use_as_it_is(node, places, identifier, is_sent=is_sent)
        return True
    node.dictionary.write(places.identifier, _PDO_OFF | identifier)
    node.dictionary.write(places.kind, _EVERY_SYNC)
    if not any(_map(node, places, wanted) for _ in range(_MAPPINGS)):
        _learn(node, pdo.number, places, is_sent=is_sent)
        return False
    node.dictionary.write(places.identifier, identifier)
    return True


def _map(node: DriveNode, places: PdoParameters, wanted: list[int]) -> bool:
    """Write a mapping in the order that CiA 301 asks for; False where the drive refuses it or keeps another one."""
    write = node.dictionary.write
    try:
        write(places.count, 0)
        for place, entry in zip(places.entries, wanted, strict=True):
            node.dictionary.send(place, entry)
        write(places.count, len(wanted))
    except DriverError as error:
        if error.kind is not DriverErrorKind.REFUSED:
            raise
        return False
    # some drives show them only when they count
    return all(node.dictionary.read(place) == entry for place, entry in zip(places.entries, wanted, strict=True))


def _use_as_it_is(node: DriveNode, places: PdoParameters, identifier: int, *, is_sent: bool) -> None:
    dictionary = node.dictionary
    kind = dictionary.read(places.kind)
    if not (kind == _EVERY_SYNC or (kind <= _LAST_SYNCHRONOUS and not is_sent)):
        dictionary.write(places.kind, _EVERY_SYNC)
    if dictionary.read(places.identifier) & (_PDO_OFF | _IDENTIFIER) != identifier:
        dictionary.write(places.identifier, identifier)


def read_mapping(node: DriveNode, places: PdoParameters) -> list[int]:
    """Mapping that a drive has."""
    count = min(node.dictionary.read_optional(places.count) or 0, _LONGEST_MAPPING)
    return [node.dictionary.read(replace(places.count, subindex=number, bits=32)) for number in range(1, count + 1)]


def _learn(node: DriveNode, number: int, places: PdoParameters, *, is_sent: bool) -> None:
    """Keep that a PDO is fixed, and what it holds; others that the drive has may be free."""
    fixed = PdoSlot(number, decode_mapping(read_mapping(node, places)) or ())
    known = {slot.number: slot for slot in (node.slots.sent if is_sent else node.slots.received)}
    others = (known.get(other) or _find(node, other, is_sent=is_sent) for other in range(PDO_COUNT) if other != number)
    slots = tuple(sorted((fixed, *(slot for slot in others if slot)), key=lambda slot: slot.number))
    received, sent = (node.slots.received, slots) if is_sent else (slots, node.slots.sent)
    node.slots = PdoSlots(received, sent)


def _find(node: DriveNode, number: int, *, is_sent: bool) -> PdoSlot | None:
    """A further PDO of a drive; None where it has none of this number."""
    places = sent_parameters(number, 0) if is_sent else received_parameters(number, 0)
    return None if node.dictionary.read_optional(places.identifier) is None else PdoSlot(number)
