"""The driver of Dynamixel servos, as the registry finds it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.driver import PATIENCE, ArmDescription, BusDriver, Connection, Option
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.inspection import Finding, FoundDevice, FrameRequest, PlannedFrame, failure


class DynamixelDriver(BusDriver):
    """Implements `BusDriver`."""

    name = "dynamixel"
    title = "Dynamixel servos"
    options = (
        Option("port", "serial device, in place of the robot file's"),
        PATIENCE,
        Option("keep_settings", "whether servos keep in EEPROM what a run changed", default=False),
    )
    block_example = "{id: 1}"
    port_help = "serial device"
    neighbours = "servos of protocol 1.0 and of Feetech answer to tauscope bus scan feetech"
    bus_options = ("port",)

    def is_meant(self, block: Mapping[str, Any]) -> bool:
        """Whether it has a servo's ``id``."""
        return "id" in block

    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm in real time."""
        from tauscope_drivers.dynamixel.arm import DynamixelArm

        keeps = settings.get("keep_settings", False)
        if not isinstance(keeps, bool):
            text = f"backend {self.name}: keep_settings is {keeps!r:.60}; give true or false"
            raise DriverError(DriverErrorKind.REFUSED, text)
        servos = DynamixelArm(arm.joints, slack_s=self.read_patience_s(settings), keeps_settings=keeps)
        return Connection(servos, is_real_time=True)

    def list_adapters(self) -> list[Finding]:
        """Serial ports of this machine."""
        from tauscope_drivers.serial_adapters import serial_adapters

        return serial_adapters()

    def check_blocks(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Blocks: servo IDs, port and units."""
        from tauscope_drivers.dynamixel.configuration import read_configuration

        try:
            read_configuration(joints)
        except DriverError as error:
            return [failure(self.name, str(error))]
        return []

    def examine(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Port, and every servo that the robot file names."""
        from tauscope_drivers.dynamixel.doctor import examine

        return examine(joints)

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Servos that answer a ping to all."""
        from tauscope_drivers.dynamixel.doctor import USUAL_BAUDS, scan_bus

        return scan_bus(port, USUAL_BAUDS if bit_rates is None else bit_rates)

    def plan_frames(self, joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a port."""
        from tauscope_drivers.dynamixel.dry_run import plan_frames

        return plan_frames(joints, request)


DRIVER = DynamixelDriver()
"""Found by the entry point ``tauscope.drivers``."""
