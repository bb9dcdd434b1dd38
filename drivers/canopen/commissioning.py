"""What a drive is told before it gets power: mode, limits, what it does when the host is gone, and its process data."""

import math

from drivers.backend import ControlMode, DriveLimits, StopPolicy
from drivers.canopen import objects
from drivers.canopen.bus import MASTER_NODE
from drivers.canopen.interpolation import interpolation_period
from drivers.canopen.node import MODES, MOTION_PDO, RECEIVED_ID, SENT_IDS, STATE_PDO, TARGET_PDOS, DriveNode
from drivers.canopen.objects import DriveObject
from drivers.canopen.pdo import PdoLayout, mapping_entries
from drivers.errors import DriverError, DriverErrorKind

PRODUCER_HEARTBEAT_MS = 100

_PDO_OFF = 1 << 31
_EVERY_SYNC = 1
_QUICK_STOP_AND_HOLD = 6
_RAMP_AND_LET_GO = 2
_ABORT_BY_QUICK_STOP = 3
_ABORT_BY_DISABLING = 2
_FAULT_BY_QUICK_STOP = 2


def commission_drive(
    node: DriveNode,
    mode: ControlMode,
    limits: DriveLimits,
    stop_policy: StopPolicy,
    watchdog_s: float,
    cycle_s: float | None,
) -> None:
    """Write all of it by service data; each value is read back.

    Parameters
    ----------
    node : DriveNode
        whose units are known
    mode : ControlMode
        who closes the loop
    limits : DriveLimits
        of all joints; the drive enforces those of position and torque
    stop_policy : StopPolicy
        ``hold`` or ``torque_off``
    watchdog_s : float
        time without the master's heartbeat after which the drive stops [s]
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
    _map(node, 0x1400, 0x1600, RECEIVED_ID, TARGET_PDOS[mode])
    for number, (identifier, layout) in enumerate(zip(SENT_IDS, (STATE_PDO, MOTION_PDO), strict=True)):
        _map(node, 0x1800 + number, 0x1A00 + number, identifier, layout)


def _write_limits(node: DriveNode, limits: DriveLimits) -> None:
    """Torque, never more than the drive allows already, and range; nothing where there is no limit."""
    joint, write = node.joint - 1, node.dictionary.write
    low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
    torque = float(limits.torque[joint])
    if math.isfinite(torque):
        allowed = node.dictionary.read(objects.LARGEST_TORQUE)
        write(objects.LARGEST_TORQUE, min(node.units.torque_cap(torque), allowed))
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


def _map(node: DriveNode, communication: int, mapping: int, identifier: int, layout: PdoLayout) -> None:
    """Write a PDO's parameters by explicit service data, in the order that CiA 301 asks for."""
    number = node.configuration.node_id
    cob_id = DriveObject("PDO COB-ID", communication, 1, 32)
    kind = DriveObject("PDO transmission type", communication, 2, 8)
    count = DriveObject("PDO number of entries", mapping, 0, 8)
    write = node.dictionary.write
    write(cob_id, _PDO_OFF | identifier + number)
    write(kind, _EVERY_SYNC)
    write(count, 0)
    entries = mapping_entries(layout.objects)
    places = [DriveObject("PDO entry", mapping, subindex, 32) for subindex in range(1, len(entries) + 1)]
    for place, entry in zip(places, entries, strict=True):
        node.dictionary.send(place, entry)
    write(count, len(entries))
    for place, entry in zip(places, entries, strict=True):  # some drives show them only when they count
        if node.dictionary.read(place) != entry:
            raise DriverError(DriverErrorKind.REFUSED, f"{node.place}: {place} is not kept; its PDOs are fixed")
    write(cob_id, identifier + number)
