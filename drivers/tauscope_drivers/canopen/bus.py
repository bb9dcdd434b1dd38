"""One CAN bus, owned by one thread: whoever waits for an answer takes the frames off the bus meanwhile.

There is no receiving thread that could die unseen, and nothing that goes on sending when the control loop hangs: SYNC
and the master's heartbeat are sent from the loop itself.
"""

import time
from collections.abc import Callable, Iterable
from contextlib import nullcontext

import can
import canopen

from tauscope_drivers.canopen.configuration import BusConfiguration
from tauscope_drivers.canopen.interfaces import ONE_PROCESS, BusClaim, ClaimedError, SerialAdapterBus, open_interface
from tauscope_drivers.canopen.sdo import NodeDictionary, PumpedSdoClient
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.errors import DriverError, DriverErrorKind

SYNC_ID = 0x080
EMERGENCY_ID = 0x080
HEARTBEAT_ID = 0x700
NMT_ID = 0x000
MASTER_NODE = 127

NMT_START = 0x01
NMT_PRE_OPERATIONAL = 0x80
NMT_OPERATIONAL_STATE = 0x05

# time in which the bus has to take a frame; the drives' own watchdog is what stops the arm meanwhile
SEND_TIMEOUT_S = 0.5
GUARD_ATTEMPTS = 3
GUARD_ANSWER_S = 0.05

_BOOT_UP = b"\0"
_MOST_DRAINED = 1000

FrameHandler = Callable[[int, bytes], None]  # takes the identifier and the payload of a frame


class CanBus:
    """Sends frames, hands received ones to their subscribers, and reads and writes object dictionaries."""

    def __init__(
        self, configuration: BusConfiguration, bus: can.BusABC | None = None, clock: Clock | None = None
    ) -> None:
        """Open the bus. Raises DriverError ``cannot-connect``: there is no interface, or another program has it."""
        self._name = f"{configuration.interface} {configuration.channel}"
        self._clock = clock or MonotonicClock()
        self._network = canopen.Network()
        self._handlers: dict[int, FrameHandler] = {}
        self._heartbeat_period_ns = 0
        self._next_heartbeat_ns = 0
        self.guarded: set[int] = set()  # nodes that each heartbeat of the master asks for their state
        self._claim: BusClaim | None = None
        try:
            self._claim = _claim_interface(configuration) if bus is None else None
            self._bus = bus or open_interface(
                configuration.interface, configuration.channel, configuration.bit_rate, configuration.options
            )
        # a missing option is a TypeError of python-can's
        except (can.CanError, OSError, ValueError, NotImplementedError, ImportError, TypeError) as error:
            self._release()
            text = " ".join(str(error).split())
            raise DriverError.no_connection(
                f"CAN bus {self._name} cannot be opened ({text}); check the adapter, its name, who else uses it, and "
                "drive.options"
            ) from error
        self._network.bus = self._bus

    def subscribe(self, identifier: int, handler: FrameHandler) -> None:
        """Hand all frames of an identifier to a handler."""
        self._handlers[identifier] = handler

    def add_node(self, node_id: int) -> NodeDictionary:
        """The object dictionary of a node."""
        client = PumpedSdoClient(self, node_id)
        client.network = self._network
        self.subscribe(client.tx_cobid, lambda identifier, data: client.on_response(identifier, data, 0.0))
        return NodeDictionary(client, node_id)

    def send(self, identifier: int, data: bytes, *, is_remote: bool = False) -> None:
        """Send a frame. Raises DriverError ``lost`` where the bus does not take it."""
        frame = can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=is_remote)
        try:
            self._bus.send(frame, timeout=SEND_TIMEOUT_S)
        except (can.CanError, OSError, ValueError) as error:
            raise self._report_loss(error) from error

    def send_together(self, frames: Iterable[tuple[int, bytes]]) -> None:
        """Send frames, identifier and payload, in their order, with one write where possible. Raises ``lost``."""
        gathering = self._bus.gathering() if isinstance(self._bus, SerialAdapterBus) else nullcontext()
        try:
            with gathering:
                for identifier, data in frames:
                    self.send(identifier, data)
        except (can.CanError, OSError, ValueError) as error:
            raise self._report_loss(error) from error

    def receive(self, deadline_ns: int) -> bool:
        """Wait for one frame and hand it to its handler, beating meanwhile; False: none came. Raises ``lost``."""
        self.beat()
        wait_s = max(0.0, (deadline_ns - time.monotonic_ns()) * 1e-9)
        if self._heartbeat_period_ns:
            wait_s = min(wait_s, self._heartbeat_period_ns * 0.5e-9)
        try:
            message = self._bus.recv(wait_s)
        except (can.CanError, OSError, ValueError) as error:
            raise self._report_loss(error) from error
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
        """Be alive to the drives while `receive` or `beat` is called. `period_s`: of heartbeats; 0 ends them [s]."""
        self._heartbeat_period_ns = round(period_s * 1e9)
        self.guarded.clear()
        self._next_heartbeat_ns = self._clock.now_ns()
        self.beat()

    def beat(self) -> None:
        """Send the master's heartbeat where it is due."""
        now = self._clock.now_ns()
        if self._heartbeat_period_ns and now >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now + self._heartbeat_period_ns
            self.send(HEARTBEAT_ID + MASTER_NODE, bytes([NMT_OPERATIONAL_STATE]))
            for node_id in self.guarded:
                self.send(HEARTBEAT_ID + node_id, b"", is_remote=True)

    def ask_guard(self, node_id: int) -> bool:
        """Ask a node that produces no heartbeat for its state by remote frames; whether it answers."""
        identifier, answers = HEARTBEAT_ID + node_id, list[bytes]()
        handler = self._handlers.get(identifier)
        self.subscribe(identifier, lambda _, data: answers.append(data))
        for _ in range(GUARD_ATTEMPTS):
            self.send(identifier, b"", is_remote=True)
            deadline = time.monotonic_ns() + round(GUARD_ANSWER_S * 1e9)
            while not answers and time.monotonic_ns() < deadline:
                self.receive(deadline)
        if handler is not None:
            self.subscribe(identifier, handler)
        return any(answer != _BOOT_UP for answer in answers)

    def command_nodes(self, command: int, node_id: int = 0) -> None:
        """Send a network-management command."""
        self.send(NMT_ID, bytes([command, node_id]))

    def close(self) -> None:
        """Let go of the bus."""
        self._heartbeat_period_ns = 0
        self._bus.shutdown()
        self._release()

    def _release(self) -> None:
        if self._claim is not None:
            self._claim.release()
            self._claim = None

    def _report_loss(self, error: Exception) -> DriverError:
        text = " ".join(str(error).split())
        return DriverError(
            DriverErrorKind.LOST, f"CAN bus {self._name} is gone ({text}); check the adapter and the cable"
        )


def _claim_interface(configuration: BusConfiguration) -> BusClaim | None:
    """The claim on an interface that several programs may open; None where only one can."""
    if configuration.interface in ONE_PROCESS:
        return None
    name = configuration.channel
    if configuration.interface != "socketcan":
        name = "-".join([configuration.interface, name, *(str(one) for one in configuration.options.values())])
    try:
        return BusClaim(name)
    except ClaimedError as error:
        raise DriverError.no_connection(
            f"CAN bus {configuration.channel} is driven by {error} already; end that first"
        ) from error
