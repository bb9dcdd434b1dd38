"""Which field buses there are, and which of them a robot file speaks of."""

from collections.abc import Mapping

from tauscope.errors import AcquisitionError
from tauscope.robot import Robot
from tauscope.robot.messages import nearest, shown
from tauscope.runtime.canopen_bus import CanopenBus
from tauscope.runtime.dynamixel_bus import DynamixelBus
from tauscope.runtime.field_bus import FieldBus

FIELD_BUSES: Mapping[str, FieldBus] = {bus.name: bus for bus in (DynamixelBus(), CanopenBus())}
"""Every field bus by its name."""


def find_bus(name: str) -> FieldBus:
    """The field bus of a name.

    Raises
    ------
    AcquisitionError
        there is no such bus
    """
    if name not in FIELD_BUSES:
        raise AcquisitionError(f"there is no field bus {shown(name)}; {nearest(name, FIELD_BUSES)}")
    return FIELD_BUSES[name]


def bus_of(robot: Robot) -> FieldBus:
    """The field bus that a robot file's ``drive`` blocks speak of.

    Raises
    ------
    AcquisitionError
        none of them, or several
    """
    meant = [bus for bus in FIELD_BUSES.values() if bus.is_meant(robot)]
    if len(meant) == 1:
        return meant[0]
    if meant:
        names = " and ".join(bus.name for bus in meant)
        raise AcquisitionError(f"{robot.name}: its drive blocks speak of {names}; choose one with --backend")
    raise AcquisitionError(
        f"{robot.name}: no joint has a drive block with a servo's id or a drive's node_id; add them, or look at the "
        "adapters alone with tauscope doctor"
    )
