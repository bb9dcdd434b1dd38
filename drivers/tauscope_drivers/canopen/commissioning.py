"""What a drive is told before it gets power: the values of its DCF file, mode, limits, watchdog, process data."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

from canopen.sdo.exceptions import SdoAbortedError

from tauscope_drivers.backend import ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.canopen import objects, process_data
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile, Setting, settings_of
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.objects import STAYING_OPTIONS, DriveObject
from tauscope_drivers.canopen.state_machine import POWERED, decode_state
from tauscope_drivers.errors import DriverError, DriverErrorKind

_STAYS_STOPPED = (6, 5)  # quick stop options that keep the power: by the quick stop ramp, by the slow one
_LETS_GO = (2, 1)
_ABORT_BY_QUICK_STOP, _ABORT_BY_FAULT, _ABORT_BY_DISABLING = 3, 1, 2
_FAULT_BY_RAMP = (2, 1)
_NOTHING = 0


def write_settings(node: DriveNode) -> bool:
    """Give a drive those values of its DCF file that it does not have yet; whether there was any.

    They may change what its positions and torques mean, so that nothing that was read before holds any more. Raises
    DriverError: ``refused``: the drive does not take a value, or is under power; ``cannot-connect``: it does not
    answer.
    """
    file = node.configuration.device_file
    if file is None:
        return False
    missing = find_missing(node, file)
    for setting in missing:
        _give(node, file, setting)
    return bool(missing)


def find_missing(node: DriveNode, file: DeviceFile) -> list[Setting]:
    """A DCF file's values that a drive lacks; only reads. Raises DriverError ``refused``, ``cannot-connect``."""
    missing = [one for one in settings_of(file).written if _read_setting(node, file, one) != one.data]
    if missing and decode_state(node.dictionary.read(objects.STATUSWORD)) in POWERED:
        raise DriverError.refusal(
            f"{node.place}: is under power, and {missing[0].entry} is not yet {missing[0].text} as {file.name} has it; "
            "support the arm and let go of it first"
        )
    return missing


def _read_setting(node: DriveNode, file: DeviceFile, setting: Setting) -> bytes:
    with _refusals_named(node, file, setting):
        return node.dictionary.read_data(setting.entry)


def _give(node: DriveNode, file: DeviceFile, setting: Setting) -> None:
    with _refusals_named(node, file, setting):
        node.dictionary.send_data(setting.entry, setting.data, setting.text)
    if (kept := _read_setting(node, file, setting)) != setting.data:
        raise DriverError.refusal(
            f"{node.place}: {setting.entry} was written as {setting.text}, as {file.name} has it, and reads back as "
            f"0x{kept[::-1].hex().upper()}; correct its ParameterValue"
        )


@contextmanager
def _refusals_named(node: DriveNode, file: DeviceFile, setting: Setting) -> Iterator[None]:
    """What a drive says against a value names the value and the file; its silence is told as always."""
    try:
        yield
    except DriverError as error:
        if not isinstance(error.__cause__, SdoAbortedError):
            raise
        raise DriverError.refusal(
            f"{node.place}: {setting.entry} = {setting.text} of {file.name} cannot be written ({error.__cause__}); "
            "correct its ParameterValue, or remove it"
        ) from error


def commission_drive(
    node: DriveNode,
    mode: ControlMode,
    limits: DriveLimits,
    stop_policy: StopPolicy,
    watchdog_s: float,
    cycle_s: float | None,
) -> None:
    """Write all of it by SDO, read back. Raises DriverError ``refused``. `cycle_s`: of SYNCs; None: the drive's [s]."""
    holds = stop_policy is StopPolicy.HOLD
    node.dictionary.write(objects.MODE_OF_OPERATION, node.mode_numbers[mode])
    option = _choose(node, objects.QUICK_STOP_OPTION, _STAYS_STOPPED if holds else _LETS_GO)
    node.stays_stopped = option in STAYING_OPTIONS
    # without a master it shall stop by itself
    aborts = (_ABORT_BY_QUICK_STOP if holds and node.stays_stopped else _ABORT_BY_DISABLING, _ABORT_BY_FAULT)
    if _choose(node, objects.ABORT_CONNECTION, aborts) == _NOTHING:
        raise DriverError.refusal(
            f"{node.place}: {objects.ABORT_CONNECTION} stays 0: it goes on when the host is gone; "
            "set it to 1, 2 or 3 with the maker's tool"
        )
    _choose(node, objects.FAULT_REACTION_OPTION, _FAULT_BY_RAMP)
    _write_limits(node, limits)
    if cycle_s is not None:
        _tell_cycle(node, cycle_s)
    node.arm_watchdog(watchdog_s)
    map_process_data(node, mode)


def _choose(node: DriveNode, entry: DriveObject, values: Sequence[int]) -> int | None:
    """Write the first value that a drive takes; what it keeps otherwise, None where it has no such object."""
    for value in values if node.has(entry) else ():
        if _accepts(partial(node.dictionary.write, entry, value)):
            return value
    return node.dictionary.read_optional(entry)


def _write_limits(node: DriveNode, limits: DriveLimits) -> None:
    """Torque, never more than the drive or its DCF file allows already, and range; nothing where there is no limit."""
    joint, write = node.joint - 1, node.dictionary.write
    low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
    torque = float(limits.torque[joint])
    file = node.configuration.device_file
    stated = None if file is None else settings_of(file).torque_cap
    caps = [] if stated is None else [stated]
    if math.isfinite(torque):
        caps.append(node.units.torque_cap(torque))
    if caps and node.has(objects.LARGEST_TORQUE):
        write(objects.LARGEST_TORQUE, min(*caps, node.dictionary.read(objects.LARGEST_TORQUE)))
    if math.isfinite(low) and math.isfinite(high):
        counts = sorted((node.units.counts(low), node.units.counts(high)))
        for entry, count in zip((objects.LOWEST_POSITION, objects.HIGHEST_POSITION), counts, strict=True):
            if node.has(entry):
                write(entry, count)


def _tell_cycle(node: DriveNode, cycle_s: float) -> None:
    """Tell the time between two targets; a drive without this object finds it from SYNC."""
    if not node.has(objects.INTERPOLATION_VALUE):
        return
    write, known = node.dictionary.write, node.dictionary.read_optional(objects.INTERPOLATION_EXPONENT)
    exponents = (_MILLISECONDS,) if known is None else _PERIOD_EXPONENTS
    try:
        value, exponent = interpolation_period(cycle_s, exponents)
        if known not in (None, exponent) and not _accepts(partial(write, objects.INTERPOLATION_EXPONENT, exponent)):
            value, _ = interpolation_period(cycle_s, (known,))
    except ValueError as error:
        raise DriverError.refusal(f"{node.place}: {error}; choose another rate") from error
    write(objects.INTERPOLATION_VALUE, value)


def _accepts(write: Callable[[], None]) -> bool:
    """Whether a drive takes what is written; its silence is raised as always."""
    try:
        write()
    except DriverError as error:
        if error.kind is not DriverErrorKind.REFUSED:
            raise
        return False
    return True


_PERIOD_EXPONENTS = range(-3, -7, -1)  # milliseconds first: some drives know nothing else
_MILLISECONDS = -3

_LARGEST_PERIOD = 0xFF
_ROUNDING = 1e-6


def interpolation_period(cycle_s: float, exponents: Sequence[int] = _PERIOD_EXPONENTS) -> tuple[int, int]:
    """Value and exponent (0x60C2) of a cycle, value · 10^exponent seconds: exact where possible, else the nearest.

    A drive moves to a target within this time: too short a time makes a halt at every target, too long a time a lag.
    Raises ValueError where the cycle is shorter or longer than the object can tell.
    """
    best: tuple[float, int, int] | None = None
    for exponent in exponents:
        value = round(cycle_s / 10.0**exponent)
        if not 1 <= value <= _LARGEST_PERIOD:
            continue
        error = abs(value * 10.0**exponent / cycle_s - 1.0)
        if best is None or error < best[0] - _ROUNDING:
            best = (error, value, exponent)
    if best is None:
        finest, coarsest = 10.0 ** min(exponents), _LARGEST_PERIOD * 10.0 ** max(exponents)
        raise ValueError(f"a cycle of {cycle_s:g} s is not between {finest:g} and {coarsest:g} s")
    return best[1:]


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
    identifier = pdo.identifier(node.configuration.node_id)
    wanted = [entry.mapping for entry in pdo.layout.objects]
    if pdo.is_fixed:
        if read_mapping(node, places) != wanted:
            _learn(node, pdo, places)
            return False
        kind = node.dictionary.read(places.kind)
        if kind != _EVERY_SYNC and (kind > _LAST_SYNCHRONOUS or pdo.direction is process_data.SENT):
            node.dictionary.write(places.kind, _EVERY_SYNC)
        if node.dictionary.read(places.identifier) & (_PDO_OFF | _IDENTIFIER) != identifier:
            node.dictionary.write(places.identifier, identifier)
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
    content, dictionary = dict(zip(places.entries, wanted, strict=True)), node.dictionary

    def write() -> None:
        dictionary.write(places.count, 0)
        for place, entry in content.items():
            dictionary.send(place, entry)
        dictionary.write(places.count, len(wanted))

    # some drives show them only when they count
    return _accepts(write) and all(dictionary.read(place) == entry for place, entry in content.items())


def read_mapping(node: DriveNode, places: process_data.PdoParameters) -> list[int]:
    """Mapping that a drive has."""
    count = min(node.dictionary.read_optional(places.count) or 0, _LONGEST_MAPPING)
    return [node.dictionary.read(replace(places.count, subindex=number, bits=32)) for number in range(1, count + 1)]


def _learn(node: DriveNode, pdo: process_data.Pdo, places: process_data.PdoParameters) -> None:
    """Keep that a PDO is fixed, and what it holds; others that the drive has may be free."""
    is_sent = pdo.direction is process_data.SENT
    slots = {slot.number: slot for slot in (node.slots.sent if is_sent else node.slots.received)}
    for number in set(range(process_data.PDO_COUNT)) - slots.keys():
        if node.dictionary.read_optional(pdo.direction.parameters(number, 0).identifier) is not None:
            slots[number] = process_data.PdoSlot(number)
    slots[pdo.number] = process_data.PdoSlot(pdo.number, process_data.decode_mapping(read_mapping(node, places)) or ())
    ordered = tuple(slots[number] for number in sorted(slots))
    node.slots = replace(node.slots, sent=ordered) if is_sent else replace(node.slots, received=ordered)
