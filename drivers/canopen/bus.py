"""One CAN bus, owned by one thread: whoever waits for an answer takes the frames off the bus meanwhile.

There is no receiving thread that could die unseen, and nothing that goes on sending when the control loop hangs: SYNC
and the master's heartbeat are sent from the loop itself.
"""

import time
from collections.abc import Callable

import can
import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoCommunicationError, SdoError

from drivers.canopen.configuration import BusConfiguration
from drivers.canopen.objects import DriveObject
from drivers.canopen.serial_adapter import SerialAdapterBus
from drivers.errors import DriverError, DriverErrorKind

SYNC_ID = 0x080
EMERGENCY_ID = 0x080
HEARTBEAT_ID = 0x700
NMT_ID = 0x000
MASTER_NODE = 127

NMT_START = 0x01
NMT_PRE_OPERATIONAL = 0x80
_NMT_OPERATIONAL_STATE = 0x05

SDO_TIMEOUT_S = 0.5

SEND_TIMEOUT_S = 0.5
"""Time in which the bus has to take a frame; the drives' own watchdog is what stops the arm meanwhile."""

_MOST_DRAINED = 1000

FrameHandler = Callable[[int, bytes], None]
"""Takes the identifier and the payload of a frame."""


class CanBus:
    """Sends frames, hands received ones to their subscribers, and reads and writes object dictionaries."""

    def __init__(self, configuration: BusConfiguration, bus: can.BusABC | None = None) -> None:
        """Open the bus.

        Parameters
        ----------
        configuration : BusConfiguration
            which bus
        bus : can.BusABC or None
            a bus that is open already, in place of the configured one

        Raises
        ------
        DriverError
            ``cannot-connect``: the interface is not there, or another program holds it
        """
        self._name = f"{configuration.interface} {configuration.channel}"
        self._network = canopen.Network()
        self._handlers: dict[int, FrameHandler] = {}
        self._heartbeat_period_ns = 0
        self._next_heartbeat_ns = 0
        try:
            self._bus = bus or _open(configuration)
        except (can.CanError, OSError, ValueError, NotImplementedError, ImportError) as error:
            text = " ".join(str(error).split())
            raise DriverError(
                DriverErrorKind.CANNOT_CONNECT,
                f"CAN bus {self._name} cannot be opened ({text}); check the adapter, its name and who else uses it",
            ) from error
        self._network.bus = self._bus

    def subscribe(self, identifier: int, handler: FrameHandler) -> None:
        """Hand all frames of an identifier to a handler.

        Parameters
        ----------
        identifier : int
            11 bits
        handler : callable
            takes the identifier and the payload
        """
        self._handlers[identifier] = handler

    def add_node(self, node_id: int) -> "NodeDictionary":
        """The object dictionary of a node.

        Parameters
        ----------
        node_id : int
            1 to 127
        """
        client = _PumpedSdoClient(self, node_id)
        client.network = self._network
        self.subscribe(client.tx_cobid, lambda identifier, data: client.on_response(identifier, bytearray(data), 0.0))
        return NodeDictionary(client, node_id)

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame.

        Parameters
        ----------
        identifier : int
            11 bits
        data : bytes
            up to 8

        Raises
        ------
        DriverError
            ``lost``: the bus does not take it
        """
        try:
            self._bus.send(
                can.Message(arbitration_id=identifier, data=data, is_extended_id=False), timeout=SEND_TIMEOUT_S
            )
        except (can.CanError, OSError, ValueError) as error:
            raise self._lost(error) from error

    def receive(self, deadline_ns: int) -> bool:
        """Wait for one frame and hand it to its handler; the heartbeat is sent meanwhile when it is due.

        Parameters
        ----------
        deadline_ns : int
            monotonic instant until which to wait [ns]

        Returns
        -------
        bool
            False where none came

        Raises
        ------
        DriverError
            ``lost``: the bus is gone
        """
        self.beat()
        wait_s = max(0.0, (deadline_ns - time.monotonic_ns()) * 1e-9)
        if self._heartbeat_period_ns:
            wait_s = min(wait_s, self._heartbeat_period_ns * 0.5e-9)
        try:
            message = self._bus.recv(wait_s)
        except (can.CanError, OSError, ValueError) as error:
            raise self._lost(error) from error
        if message is None:
            return False
        if message.is_error_frame or message.is_extended_id or message.is_remote_frame:
            return True
        handler = self._handlers.get(message.arbitration_id)
        if handler is not None:
            handler(message.arbitration_id, bytes(message.data))
        return True

    def drain(self) -> None:
        """Hand all frames that have come to their handlers: an answer that is late is not taken for the next."""
        now = time.monotonic_ns()
        for _ in range(_MOST_DRAINED):
            if not self.receive(now):
                return

    def start_heartbeat(self, period_s: float) -> None:
        """Be alive to the drives from now on, as long as `receive` or `beat` is called.

        Parameters
        ----------
        period_s : float
            time between heartbeats; 0 ends them [s]
        """
        self._heartbeat_period_ns = round(period_s * 1e9)
        self._next_heartbeat_ns = time.monotonic_ns()
        self.beat()

    def beat(self) -> None:
        """Send the master's heartbeat where it is due."""
        now = time.monotonic_ns()
        if self._heartbeat_period_ns and now >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now + self._heartbeat_period_ns
            self.send(HEARTBEAT_ID + MASTER_NODE, bytes([_NMT_OPERATIONAL_STATE]))

    def command_nodes(self, command: int, node_id: int = 0) -> None:
        """Send a network-management command.

        Parameters
        ----------
        command : int
            `NMT_START`, `NMT_PRE_OPERATIONAL`
        node_id : int
            0 for all
        """
        self.send(NMT_ID, bytes([command, node_id]))

    def close(self) -> None:
        """Let go of the bus."""
        self._heartbeat_period_ns = 0
        self._bus.shutdown()

    def _lost(self, error: Exception) -> DriverError:
        text = " ".join(str(error).split())
        return DriverError(
            DriverErrorKind.LOST, f"CAN bus {self._name} is gone ({text}); check the adapter and the cable"
        )


def _open(configuration: BusConfiguration) -> can.BusABC:
    """The bus that python-can knows by this name."""
    if configuration.interface == "slcan":
        return SerialAdapterBus(configuration.channel, configuration.bit_rate)
    return can.Bus(interface=configuration.interface, channel=configuration.channel, bitrate=configuration.bit_rate)


class NodeDictionary:
    """The object dictionary of one node, read and written by service data."""

    def __init__(self, client: SdoClient, node_id: int) -> None:
        """Reach a node; nothing is sent yet.

        Parameters
        ----------
        client : SdoClient
            of the node
        node_id : int
            1 to 127
        """
        self._client = client
        self.node_id = node_id

    def read(self, entry: DriveObject) -> int:
        """Value of an entry.

        Parameters
        ----------
        entry : DriveObject
            what to read

        Raises
        ------
        DriverError
            ``cannot-connect``: the node does not answer, or has no such entry
        """
        try:
            data = self._client.upload(entry.index, entry.subindex)
        except (SdoError, can.CanError, OSError) as error:
            raise self._failure(f"{entry} cannot be read", error) from error
        return int.from_bytes(data[: entry.bits // 8], "little", signed=entry.signed)

    def read_optional(self, entry: DriveObject) -> int | None:
        """Value of an entry that not every drive has; None where the drive has none.

        Parameters
        ----------
        entry : DriveObject
            what to read
        """
        try:
            return self.read(entry)
        except DriverError as error:
            if isinstance(error.__cause__, SdoCommunicationError):
                raise
            return None

    def read_text(self, entry: DriveObject) -> str:
        """A text; empty where the node has none.

        Parameters
        ----------
        entry : DriveObject
            what to read
        """
        try:
            return self._client.upload(entry.index, entry.subindex).decode("ascii", "replace").strip("\0 ")
        except (SdoError, can.CanError, OSError):
            return ""

    def write(self, entry: DriveObject, value: int) -> None:
        """Write an entry and read it back.

        Parameters
        ----------
        entry : DriveObject
            what to write
        value : int
            that fits the entry

        Raises
        ------
        DriverError
            ``refused``: the drive keeps another value; ``cannot-connect``: it does not answer or forbids the write
        """
        data = value.to_bytes(entry.bits // 8, "little", signed=entry.signed)
        try:
            self._client.download(entry.index, entry.subindex, data)
        except (SdoError, can.CanError, OSError) as error:
            raise self._failure(f"{entry} = {value} cannot be written", error) from error
        kept = self.read(entry)
        if kept != value:
            raise DriverError(
                DriverErrorKind.REFUSED,
                f"node {self.node_id}: {entry} was written as {value} and reads {kept}; the drive limits or forbids it",
            )

    def _failure(self, what: str, error: Exception) -> DriverError:
        return DriverError(
            DriverErrorKind.CANNOT_CONNECT,
            f"node {self.node_id}: {what} ({' '.join(str(error).split())}); check node number, power and wiring",
        )


class _PumpedSdoClient(SdoClient):
    """The library's SDO client, taking its answers off the bus itself instead of from a receiving thread."""

    RESPONSE_TIMEOUT = SDO_TIMEOUT_S
    MAX_RETRIES = 2

    def __init__(self, bus: CanBus, node_id: int) -> None:
        super().__init__(0x600 + node_id, 0x580 + node_id, ObjectDictionary())
        self._pumped_bus = bus

    def read_response(self) -> bytes:
        """Answer of the node, as the library reads it, after frames were taken off the bus until there is one."""
        deadline = time.monotonic_ns() + round(SDO_TIMEOUT_S * 1e9)
        while self.responses.empty():
            if not self._pumped_bus.receive(deadline) and time.monotonic_ns() >= deadline:
                raise SdoCommunicationError("no answer to a service data request")
        return super().read_response()
