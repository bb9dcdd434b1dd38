"""The driver of Feetech STS3215 servos, as the registry finds it."""

from collections.abc import Mapping
from typing import Any

from tauscope_drivers.driver import ArmDescription, Connection, SerialBusDriver


class FeetechDriver(SerialBusDriver):
    """Implements `BusDriver`."""

    name = "feetech"
    title = "Feetech STS3215 servos"
    id_key = "servo_id"
    block_example = "{servo_id: 1}"
    answering = "servos of Feetech, and Dynamixel servos of protocol 1.0,"

    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm in real time."""
        from tauscope_drivers.feetech.arm import FeetechArm

        return Connection(FeetechArm(arm.joints, slack_s=self.read_patience_s(settings)), is_real_time=True)


DRIVER = FeetechDriver()
