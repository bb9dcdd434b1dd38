"""The bus of CiA 402 drives on CANopen, from a robot file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from tauscope.errors import AcquisitionError
from tauscope.robot import Robot
from tauscope.robot.messages import shown
from tauscope.runtime.field_bus import FrameRequest, check_settings, drive_blocks, drivers_words
from tauscope_drivers import Backend
from tauscope_drivers.inspection import Finding, FoundDevice, PlannedFrame

if TYPE_CHECKING:
    from tauscope_drivers.canopen import DriveJoint

_BUS_SETTINGS = ("interface", "channel")


class CanopenBus:
    """Implements `FieldBus`; the libraries behind it are imported when they are used."""

    name = "canopen"

    def is_meant(self, robot: Robot) -> bool:
        """Whether a joint's ``drive`` block has a ``node_id``."""
        return any("node_id" in (joint.drive or {}) for joint in robot.joints)

    def backend(self, robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Backend:
        """The arm, not connected yet."""
        del folder
        from tauscope_drivers.canopen import CanopenArm

        patience_s = check_settings(self.name, settings, _BUS_SETTINGS)
        with drivers_words():
            return CanopenArm(_joints(robot, settings), patience_s=patience_s)

    def adapters(self) -> list[Finding]:
        """CAN interfaces of this machine."""
        from tauscope_drivers.canopen import can_interfaces

        return can_interfaces()

    def examine(self, robot: Robot) -> list[Finding]:
        """Bus, and every drive that the robot file names."""
        from tauscope_drivers.canopen import examine

        with drivers_words():
            return examine(_joints(robot))

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Nodes that answer when they are asked for their device type.

        Parameters
        ----------
        bit_rates : sequence of int or None
            to try [bit/s]; the usual ones where None
        """
        from tauscope_drivers.canopen import scan_bus

        interface, separator, channel = port.partition(":")
        if not separator or not interface or not channel:
            raise AcquisitionError(f"{shown(port)} names no CAN bus; write INTERFACE:CHANNEL, as in socketcan:can0")
        with drivers_words():
            yield from scan_bus(interface, channel, bit_rates)

    def planned_frames(self, robot: Robot, request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a bus."""
        from tauscope_drivers.canopen import plan_frames

        with drivers_words():
            yield from plan_frames(
                _joints(robot), request.mode, request.limits, request.watchdog_s, request.targets, request.cycle_s
            )


def _joints(robot: Robot, settings: Mapping[str, Any] = MappingProxyType({})) -> list["DriveJoint"]:
    """The joints as the driver sees them, on the bus of the settings where they name one."""
    from tauscope_drivers.canopen import DriveJoint

    bus = {key: settings[key] for key in _BUS_SETTINGS if key in settings}
    blocks = drive_blocks(robot, "{node_id: 1, ...}", bus)
    return [DriveJoint(joint.name, joint.gear_ratio or 1.0, _beside(robot, drive)) for joint, drive in blocks]


def _beside(robot: Robot, drive: dict[str, Any]) -> dict[str, Any]:
    """A ``drive`` block whose EDS or DCF file is looked up beside the robot file, as other files that it names."""
    file = drive.get("eds")
    if robot.source is None or not isinstance(file, str) or not file:
        return drive
    return {**drive, "eds": str(robot.source.parent / file)}
