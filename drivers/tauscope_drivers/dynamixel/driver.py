"""The driver of Dynamixel servos, as the registry finds it."""

from collections.abc import Mapping
from typing import Any

from tauscope_drivers.driver import ArmDescription, Connection, Option, SerialBusDriver
from tauscope_drivers.errors import DriverError


class DynamixelDriver(SerialBusDriver):
    """Implements `BusDriver`."""

    name = "dynamixel"
    title = "Dynamixel servos"
    options = (
        *SerialBusDriver.options,
        Option("keep_settings", "whether servos keep in EEPROM what a run changed", default=False),
    )
    id_key = "id"
    block_example = "{id: 1}"
    answering = "Dynamixel servos of protocol 2.0"

    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm in real time."""
        from tauscope_drivers.dynamixel.arm import DynamixelArm

        keeps = settings.get("keep_settings", False)
        if not isinstance(keeps, bool):
            raise DriverError.refusal(f"backend {self.name}: keep_settings is {keeps!r:.60}; give true or false")
        servos = DynamixelArm(arm.joints, slack_s=self.read_patience_s(settings), keeps_settings=keeps)
        return Connection(servos, is_real_time=True)


DRIVER = DynamixelDriver()
