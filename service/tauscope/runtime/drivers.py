"""The registry of drivers, by the entry points ``tauscope.drivers``. Nothing else in tauscope names a backend."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from tauscope.errors import AcquisitionError
from tauscope.extras import require_extra
from tauscope.robot import Joint, Robot
from tauscope.robot.messages import nearest, shown
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.driver import ArmDescription, BusDriver, Connection, Driver
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, FoundDevice, FrameRequest, PlannedFrame, Severity

__all__ = [
    "DEFAULT_BACKEND",
    "BackendName",
    "BusDriver",
    "Connection",
    "Driver",
    "Finding",
    "FoundDevice",
    "FrameRequest",
    "PlannedFrame",
    "Severity",
    "bus_drivers",
    "describe_neighbours",
    "driver_names",
    "find_bus",
    "find_driver",
    "make_backend",
    "select_bus",
    "to_drive_joints",
    "translate_driver_errors",
]

ENTRY_POINT_GROUP = "tauscope.drivers"
DEFAULT_BACKEND = "sim"  # what moves the arm where nothing is said: it does no harm
_UNSTATED_CONSTANT = 1.0  # A robot file that states no torque constant reads so


@cache
def _entries() -> Mapping[str, EntryPoint]:
    found = sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda one: (one.name != DEFAULT_BACKEND, one.name))
    if not found:
        raise AcquisitionError("no driver is registered; install tauscope again (pip install -e . in a source tree)")
    return {entry.name: entry for entry in found}


def driver_names() -> tuple[str, ...]:
    """Names of all registered drivers, the default first; loads none of them."""
    return tuple(_entries())


if TYPE_CHECKING:
    BackendName = str
else:
    BackendName = Literal[driver_names()]
    """A name of a registered driver, for models whose schema lists the choices."""


@cache
def find_driver(name: str) -> Driver:
    """The driver of a name. Raises AcquisitionError where there is no such driver, or it cannot be loaded."""
    entry = _entries().get(name)
    if entry is None:
        raise AcquisitionError(f"there is no backend {shown(name)}; {nearest(name, _entries())}")
    try:
        driver = entry.load()
    except Exception as error:
        raise AcquisitionError(f"driver {name} ({entry.value}) cannot be loaded: {error}") from error
    if not isinstance(driver, Driver) or driver.name != name:
        raise AcquisitionError(f"driver {name} ({entry.value}) is no Driver of that name: correct the plugin")
    return driver


def bus_drivers() -> Mapping[str, BusDriver]:
    drivers = map(find_driver, driver_names())
    return {driver.name: driver for driver in drivers if isinstance(driver, BusDriver)}


def find_bus(name: str) -> BusDriver:
    """The driver of a field bus. Raises AcquisitionError where there is no such bus."""
    known = bus_drivers()
    if name not in known:
        raise AcquisitionError(f"there is no field bus {shown(name)}; {nearest(name, known)}")
    return known[name]


def describe_neighbours(bus: BusDriver) -> str:
    """What may hang on a bus on which nobody answers its driver; empty where nothing is known."""
    others = [other for other in bus_drivers().values() if other is not bus and other.port_help == bus.port_help]
    known = [f"{other.answering} answer to tauscope bus scan {other.name}" for other in others if other.answering]
    return "; ".join([*filter(None, [bus.neighbours]), *known])


def select_bus(robot: Robot) -> BusDriver:
    """The driver of the bus that ``drive`` blocks speak of. Raises AcquisitionError: none of them, or several."""
    blocks = [joint.drive or {} for joint in robot.joints]
    meant = [bus for bus in bus_drivers().values() if any(map(bus.is_meant, blocks))]
    if len(meant) == 1:
        return meant[0]
    if meant:
        names = " and ".join(bus.name for bus in meant)
        raise AcquisitionError(f"{robot.name}: its drive blocks speak of {names}; choose one with --backend")
    examples = " or ".join(bus.block_example for bus in bus_drivers().values())
    raise AcquisitionError(
        f"{robot.name}: no joint has a drive block that a bus knows; add them, as in drive: {examples}, or look at the "
        "adapters alone with tauscope doctor"
    )


def make_backend(name: str, robot: Robot, settings: Mapping[str, Any], *, folder: Path | None = None) -> Connection:
    """A backend, not connected; `folder`: for its own files. Raises AcquisitionError or MissingExtraError."""
    driver = find_driver(name)
    for key in settings:
        if key not in driver.option_names:
            hint = nearest(str(key), driver.option_names)
            raise AcquisitionError(f"backend {name}: unknown setting {shown(key)}; {hint}")
    with translate_driver_errors(), require_extra(f"backend {name}"):
        return driver.make_backend(ArmDescription(to_drive_joints(driver, robot, settings), robot, folder), settings)


def to_drive_joints(
    driver: Driver, robot: Robot, settings: Mapping[str, Any] = MappingProxyType({})
) -> tuple[DriveJoint, ...]:
    """The joints as a driver sees them. Raises AcquisitionError where a joint on a bus has no ``drive`` block."""
    joints = [_to_drive_joint(driver, robot, joint) for joint in robot.joints]
    if isinstance(driver, BusDriver):
        bus = {key: settings[key] for key in driver.bus_options if settings.get(key) is not None}
        joints[0] = replace(joints[0], drive={**joints[0].drive, **bus})
    return tuple(joints)


def _to_drive_joint(driver: Driver, robot: Robot, joint: Joint) -> DriveJoint:
    if joint.drive is None and isinstance(driver, BusDriver):
        example = driver.block_example
        raise AcquisitionError(f"{robot.name}: {joint.name} has no drive block; state one, as in drive: {example}")
    drive = dict(joint.drive or {})
    for key in driver.file_keys:
        file = drive.get(key)
        if robot.source is not None and isinstance(file, str) and file:
            drive[key] = str(robot.source.parent / file)
    constant = None if joint.torque_constant == _UNSTATED_CONSTANT else joint.sign * joint.torque_constant
    return DriveJoint(
        joint.name,
        drive,
        gear_ratio=joint.gear_ratio or 1.0,
        torque_per_unit=constant,
        torque_limit=joint.limits.torque,
        velocity_limit=joint.limits.velocity,
        position_range=joint.limits.position,
    )


@contextmanager
def translate_driver_errors() -> Iterator[None]:
    """Raises AcquisitionError in place of `DriverError`, in the same words."""
    try:
        yield
    except DriverError as error:
        raise AcquisitionError(str(error)) from error
