"""The driver of CiA 402 drives on CANopen, as the registry finds it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.driver import PATIENCE, ArmDescription, BusDriver, Connection, Option
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, FoundDevice


class CanopenDriver(BusDriver):
    """Implements `BusDriver`."""

    name = "canopen"
    title = "CANopen drives"
    options = (
        Option("interface", "interface of python-can, in place of the robot file's"),
        Option("channel", "its channel, in place of the robot file's"),
        PATIENCE,
    )
    file_keys = ("eds",)
    id_key = "node_id"
    block_example = "{node_id: 1, ...}"
    port_help = "INTERFACE:CHANNEL of python-can"
    answering = "CiA 402 drives"
    neighbours = "motors of Damiao, Robstride, ODrive and moteus speak no CANopen"
    bus_options = ("interface", "channel")

    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm in real time."""
        from tauscope_drivers.canopen.arm import CanopenArm

        return Connection(CanopenArm(arm.joints, patience_s=self.read_patience_s(settings)), is_real_time=True)

    def list_adapters(self) -> list[Finding]:
        """CAN interfaces of this machine."""
        return self.load("doctor").can_interfaces()

    def check_blocks(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Blocks, and the EDS or DCF files that they name."""
        return self.load("configuration").check_blocks(joints)

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Nodes that answer when they are asked for their device type."""
        interface, _, channel = port.partition(":")
        if not interface or not channel:
            raise DriverError.refusal(f"{port!r:.60} names no CAN bus; write INTERFACE:CHANNEL, as in socketcan:can0")
        return self.load("doctor").scan_bus(interface, channel, bit_rates)


DRIVER = CanopenDriver()
