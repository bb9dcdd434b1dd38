"""The bus of Dynamixel servos, from a robot file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tauscope.robot import Joint, Robot
from tauscope.runtime.field_bus import FrameRequest, check_settings, drive_blocks, drivers_words
from tauscope_drivers import Backend
from tauscope_drivers.inspection import Finding, FoundDevice, PlannedFrame

if TYPE_CHECKING:
    from tauscope_drivers.dynamixel import DynamixelJoint

UNSTATED_CONSTANT = 1.0
"""A robot file that states no torque constant reads so; no servo gives a newton metre for a milliampere."""


class DynamixelBus:
    """Implements `FieldBus`; the library behind it is imported when it is used."""

    name = "dynamixel"

    def is_meant(self, robot: Robot) -> bool:
        """Whether a joint's ``drive`` block has a servo's ``id``."""
        return any("id" in (joint.drive or {}) for joint in robot.joints)

    def backend(self, robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Backend:
        """The arm, not connected yet."""
        del folder
        from tauscope_drivers.dynamixel import DynamixelArm

        patience_s = check_settings(self.name, settings, ("port",))
        with drivers_words():
            return DynamixelArm(dynamixel_joints(robot, settings.get("port")), slack_s=patience_s)

    def adapters(self) -> list[Finding]:
        """Serial ports of this machine."""
        from tauscope_drivers.dynamixel import serial_adapters

        return serial_adapters()

    def examine(self, robot: Robot) -> list[Finding]:
        """Port, and every servo that the robot file names."""
        from tauscope_drivers.dynamixel import examine

        with drivers_words():
            return examine(dynamixel_joints(robot))

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Servos that answer a ping to all.

        Parameters
        ----------
        bit_rates : sequence of int or None
            baud rates to try [bit/s]; all that servos can be set to where None
        """
        from tauscope_drivers.dynamixel import USUAL_BAUDS, scan_bus

        with drivers_words():
            yield from scan_bus(port, USUAL_BAUDS if bit_rates is None else bit_rates)

    def planned_frames(self, robot: Robot, request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a port."""
        from tauscope_drivers.dynamixel import plan_frames

        with drivers_words():
            yield from plan_frames(
                dynamixel_joints(robot),
                request.mode,
                request.limits,
                request.watchdog_s,
                request.targets,
                request.cycle_s,
            )


def dynamixel_joints(robot: Robot, port: Any = None) -> list["DynamixelJoint"]:
    """The joints of a robot file as the driver sees them.

    Parameters
    ----------
    port : object
        serial device in place of the robot file's; None for that

    Raises
    ------
    AcquisitionError
        a joint has no ``drive`` block
    """
    from tauscope_drivers.dynamixel import DynamixelJoint

    blocks = drive_blocks(robot, "{id: 1}", {} if port is None else {"port": port})
    return [DynamixelJoint(joint.name, drive, _stated_constant(joint)) for joint, drive in blocks]


def _stated_constant(joint: Joint) -> float | None:
    """Joint torque for a milliampere, with the joint's sign [Nm/mA]; None where the file states none."""
    return None if joint.torque_constant == UNSTATED_CONSTANT else joint.sign * joint.torque_constant
