"""What a drive is told before it gets power: the values of its DCF file, mode, limits, watchdog, process data."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from canopen.sdo.exceptions import SdoAbortedError

from tauscope_drivers.backend import ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import MASTER_NODE
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile
from tauscope_drivers.canopen.data_sheet.settings import Setting, settings_of
from tauscope_drivers.canopen.node import MODES, DriveNode
from tauscope_drivers.canopen.process_data import (
    MOTION_PDO,
    RECEIVED_ID,
    SENT_IDS,
    STATE_PDO,
    TARGET_PDOS,
    PdoLayout,
    PdoParameters,
    mapping_entries,
    received_parameters,
    sent_parameters,
)
from tauscope_drivers.canopen.state_machine import POWERED, decode_state
from tauscope_drivers.errors import DriverError, DriverErrorKind

PRODUCER_HEARTBEAT_MS = 100

_PDO_OFF = 1 << 31
_MAPPINGS = 2
"""What is not kept the first time may have been altered on its way."""

_EVERY_SYNC = 1
_QUICK_STOP_AND_HOLD = 6
_RAMP_AND_LET_GO = 2
_ABORT_BY_QUICK_STOP = 3
_ABORT_BY_DISABLING = 2
_FAULT_BY_QUICK_STOP = 2


def write_settings(node: DriveNode) -> bool:
    """Give a drive those values of its DCF file that it does not have yet; whether there was any.

    They may change what its positions and torques mean, so that nothing that was read before holds any more.

    Raises
    ------
    DriverError
        ``refused``: the drive does not take a value, or is under power; ``cannot-connect``: it does not answer
    """
    file = node.configuration.device_file
    if file is None:
        return False
    missing = [one for one in settings_of(file).written if _kept(node, file, one) != one.data]
    if missing and decode_state(node.dictionary.read(objects.STATUSWORD)) in POWERED:
        raise DriverError(
            DriverErrorKind.REFUSED,
            f"{node.place}: is under power, and {missing[0].entry} is not yet {missing[0].text} as {file.name} has it; "
            "support the arm and let go of it first",
        )
    for setting in missing:
        _give(node, file, setting)
    return bool(missing)


def _kept(node: DriveNode, file: DeviceFile, setting: Setting) -> bytes:
    """What the drive has where a setting goes."""
    with _refusals_named(node, file, setting):
        return node.dictionary.read_data(setting.entry)


def _give(node: DriveNode, file: DeviceFile, setting: Setting) -> None:
    """Write one value and read it back."""
    with _refusals_named(node, file, setting):
        node.dictionary.send_data(setting.entry, setting.data, setting.text)
    if (kept := _kept(node, file, setting)) != setting.data:
        raise DriverError(
            DriverErrorKind.REFUSED,
            f"{node.place}: {setting.entry} was written as {setting.text}, as {file.name} has it, and reads back as "
            f"0x{kept[::-1].hex().upper()}; correct its ParameterValue",
        )


@contextmanager
def _refusals_named(node: DriveNode, file: DeviceFile, setting: Setting) -> Iterator[None]:
    """What a drive says against a value names the value and the file; its silence is told as always."""
    try:
        yield
    except DriverError as error:
        if not isinstance(error.__cause__, SdoAbortedError):
            raise
        raise DriverError(
            DriverErrorKind.REFUSED,
            f"{node.place}: {setting.entry} = {setting.text} of {file.name} cannot be written ({error.__cause__}); "
            "correct its ParameterValue, or remove it",
        ) from error


def commission_drive(
    node: DriveNode,
    mode: ControlMode,
    limits: DriveLimits,
    stop_policy: StopPolicy,
    watchdog_s: float,
    cycle_s: float | None,
) -> None:
    """Write all of it by SDO; each value is read back.

    Parameters
    ----------
    cycle_s : float or None
        time between two SYNCs; the drive keeps the one that it knows where None [s]

    Raises
    ------
    DriverError
        ``refused``: the drive does not take a value
    """
    write = node.dictionary.write
    holds = stop_policy is StopPolicy.HOLD
    write(objects.MODE_OF_OPERATION, MODES[mode])
    write(objects.QUICK_STOP_OPTION, _QUICK_STOP_AND_HOLD if holds else _RAMP_AND_LET_GO)
    write(objects.ABORT_CONNECTION, _ABORT_BY_QUICK_STOP if holds else _ABORT_BY_DISABLING)
    write(objects.FAULT_REACTION_OPTION, _FAULT_BY_QUICK_STOP)
    _write_limits(node, limits)
    if cycle_s is not None:
        _tell_cycle(node, cycle_s)
    write(objects.CONSUMER_HEARTBEAT, MASTER_NODE << 16 | round(watchdog_s * 1e3))
    write(objects.PRODUCER_HEARTBEAT, PRODUCER_HEARTBEAT_MS)
    _map(node, received_parameters(TARGET_PDOS[mode]), RECEIVED_ID, TARGET_PDOS[mode])
    for number, (identifier, layout) in enumerate(zip(SENT_IDS, (STATE_PDO, MOTION_PDO), strict=True)):
        _map(node, sent_parameters(number, layout), identifier, layout)


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
    if caps:
        write(objects.LARGEST_TORQUE, min(*caps, node.dictionary.read(objects.LARGEST_TORQUE)))
    if math.isfinite(low) and math.isfinite(high):
        counts = sorted((node.units.counts(low), node.units.counts(high)))
        write(objects.LOWEST_POSITION, counts[0])
        write(objects.HIGHEST_POSITION, counts[1])


def _tell_cycle(node: DriveNode, cycle_s: float) -> None:
    """Tell the time between two targets; a drive without this object finds it from SYNC."""
    if node.dictionary.read_optional(objects.INTERPOLATION_VALUE) is None:
        return
    try:
        value, exponent = interpolation_period(cycle_s)
    except ValueError as error:
        raise DriverError(DriverErrorKind.REFUSED, f"{node.place}: {error}; choose another rate") from error
    if node.dictionary.read(objects.INTERPOLATION_EXPONENT) != exponent:
        node.dictionary.write(objects.INTERPOLATION_EXPONENT, exponent)
    node.dictionary.write(objects.INTERPOLATION_VALUE, value)


def _map(node: DriveNode, places: PdoParameters, identifier: int, layout: PdoLayout) -> None:
    """Write a PDO's parameters by explicit SDOs, in the order that CiA 301 asks for."""
    number, write = node.configuration.node_id, node.dictionary.write
    write(places.identifier, _PDO_OFF | identifier + number)
    write(places.kind, _EVERY_SYNC)
    entries = dict(zip(places.entries, mapping_entries(layout.objects), strict=True))
    for _ in range(_MAPPINGS):
        write(places.count, 0)
        for place, entry in entries.items():
            node.dictionary.send(place, entry)
        write(places.count, len(entries))
        # some drives show them only when they count
        strange = [place for place, entry in entries.items() if node.dictionary.read(place) != entry]
        if not strange:
            break
    else:
        raise DriverError(DriverErrorKind.REFUSED, f"{node.place}: {strange[0]} is not kept; its PDOs are fixed")
    write(places.identifier, identifier + number)


_PERIOD_EXPONENTS = range(-3, -7, -1)
"""Milliseconds first: some drives know nothing else."""

_LARGEST_PERIOD = 0xFF
_ROUNDING = 1e-6


def interpolation_period(cycle_s: float) -> tuple[int, int]:
    """Value and exponent (0x60C2) of a cycle, value · 10^exponent seconds: exact where possible, else the nearest.

    A drive moves to a target within this time: too short a time makes a halt at every target, too long a time a lag.

    Raises
    ------
    ValueError
        the cycle is shorter or longer than the object can tell
    """
    best: tuple[float, int, int] | None = None
    for exponent in _PERIOD_EXPONENTS:
        value = round(cycle_s / 10.0**exponent)
        if not 1 <= value <= _LARGEST_PERIOD:
            continue
        error = abs(value * 10.0**exponent / cycle_s - 1.0)
        if best is None or error < best[0] - _ROUNDING:
            best = (error, value, exponent)
    if best is None:
        raise ValueError(f"a cycle of {cycle_s:g} s is not between 1 µs and {_LARGEST_PERIOD} ms")
    return best[1:]
