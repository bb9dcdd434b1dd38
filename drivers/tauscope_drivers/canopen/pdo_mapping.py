"""Mapping a drive's PDOs; one whose mapping it does not let change is used as it is."""

from dataclasses import replace

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects, process_data
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.errors import DriverError, DriverErrorKind

_PDO_OFF = 1 << 31
_IDENTIFIER = 0x7FF
_EVERY_SYNC = 1
_LAST_SYNCHRONOUS = 240
_LONGEST_MAPPING = 8
_MAPPINGS = 2  # what is not kept the first time may have been altered on its way
_FIRST_OBJECT = 0x1000  # below are data types, by which places of a PDO are kept free
_COMMANDED = {objects.CONTROLWORD, objects.TARGET_POSITION, objects.TARGET_TORQUE, objects.INTERPOLATION_DATA}


def map_process_data(node: DriveNode, mode: ControlMode) -> None:
    """Write the parameters of all PDOs that a mode needs, by explicit SDOs, and listen to them.

    Raises DriverError ``refused`` where a needed object is in none of its PDOs, or a PDO is not exchanged at SYNC.
    """
    for _ in range(2 * process_data.PDO_COUNT + 1):
        plan = require_plan(node, mode)
        if all(_write_pdo(node, pdo) for pdo in (*plan.received, *plan.sent)):
            break
    else:
        raise DriverError.refusal(f"{node.place}: its PDO mapping reads differently each time; check the wiring")
    node.use_plan(plan)
    unknown = {entry for pdo in plan.received for entry in pdo.layout.objects} - _COMMANDED
    # a frame of fixed mapping holds other objects as well: they keep the values that they have
    held = {entry: 0 if entry.index < _FIRST_OBJECT else node.dictionary.read(entry) for entry in unknown}
    node.held = held | dict.fromkeys(_COMMANDED, 0)


def require_plan(node: DriveNode, mode: ControlMode) -> process_data.PdoPlan:
    """PDOs for a mode. Raises DriverError ``refused`` where a needed object is in none of them."""
    plan = node.plan_for(mode)
    if plan.missing:
        raise DriverError.refusal(
            f"{node.place}: {plan.missing[0]} is in none of its PDOs, and their mapping is fixed; "
            "map it with the maker's tool, or use another drive"
        )
    return plan


def _write_pdo(node: DriveNode, pdo: process_data.Pdo) -> bool:
    """Set up one PDO; False where its mapping cannot be written, and is known as fixed from now on."""
    places = pdo.direction.parameters(pdo.number, len(pdo.layout.objects))
    identifier = pdo.direction.identifier(pdo.number, node.configuration.node_id)
    wanted = process_data.mapping_entries(pdo.layout.objects)
    if pdo.is_fixed:
        if read_mapping(node, places) != wanted:
            _learn(node, pdo, places)
            return False
        _use_as_it_is(node, places, identifier, is_sent=pdo.direction is process_data.SENT)
        return True
    node.dictionary.write(places.identifier, _PDO_OFF | identifier)
    node.dictionary.write(places.kind, _EVERY_SYNC)
    if not any(_map(node, places, wanted) for _ in range(_MAPPINGS)):
        _learn(node, pdo, places)
        return False
    node.dictionary.write(places.identifier, identifier)
    return True


def _map(node: DriveNode, places: process_data.PdoParameters, wanted: list[int]) -> bool:
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


def _use_as_it_is(node: DriveNode, places: process_data.PdoParameters, identifier: int, *, is_sent: bool) -> None:
    dictionary = node.dictionary
    kind = dictionary.read(places.kind)
    if not (kind == _EVERY_SYNC or (kind <= _LAST_SYNCHRONOUS and not is_sent)):
        dictionary.write(places.kind, _EVERY_SYNC)
    if dictionary.read(places.identifier) & (_PDO_OFF | _IDENTIFIER) != identifier:
        dictionary.write(places.identifier, identifier)


def read_mapping(node: DriveNode, places: process_data.PdoParameters) -> list[int]:
    """Mapping that a drive has."""
    count = min(node.dictionary.read_optional(places.count) or 0, _LONGEST_MAPPING)
    return [node.dictionary.read(replace(places.count, subindex=number, bits=32)) for number in range(1, count + 1)]


def _learn(node: DriveNode, pdo: process_data.Pdo, places: process_data.PdoParameters) -> None:
    """Keep that a PDO is fixed, and what it holds; others that the drive has may be free."""
    slots = {
        slot.number: slot for slot in (node.slots.sent if pdo.direction is process_data.SENT else node.slots.received)
    }
    for number in set(range(process_data.PDO_COUNT)) - slots.keys():
        if node.dictionary.read_optional(pdo.direction.parameters(number, 0).identifier) is not None:
            slots[number] = process_data.PdoSlot(number)
    slots[pdo.number] = process_data.PdoSlot(pdo.number, process_data.decode_mapping(read_mapping(node, places)) or ())
    ordered = tuple(slots[number] for number in sorted(slots))
    received, sent = (
        (node.slots.received, ordered) if pdo.direction is process_data.SENT else (ordered, node.slots.sent)
    )
    node.slots = process_data.PdoSlots(received, sent)
