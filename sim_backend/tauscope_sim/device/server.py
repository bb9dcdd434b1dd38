"""The device process: keeps the simulated drives in step with the machine's clock, and serves one host at a time."""

import contextlib
import os
import select
import socket
import struct
import time
from pathlib import Path

from tauscope_drivers import DriverError, StopPolicy
from tauscope_sim.device import messages
from tauscope_sim.device.device import SimulatedDevice
from tauscope_sim.device.drives import Activity
from tauscope_sim.device.faults import Injection

_INTERVAL_NS = 4_000_000
_INTERVAL_AT_REST_NS = 500_000_000
FIXED_COLUMNS = ("time_ns", "activity", "faults")


class TraceWriter:
    """A CSV file of time, activity, faults, true position and velocity, whole up to the last line however it ends."""

    def __init__(self, path: Path, device: SimulatedDevice) -> None:
        self._device = device
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o644)
        count = device.capabilities.joint_count
        names = [*FIXED_COLUMNS, *(f"{kind}{joint + 1}" for kind in ("q", "qd") for joint in range(count))]
        self._write(",".join(names))
        self._last: tuple[Activity, tuple[str, ...]] | None = None
        self._due_ns = 0

    def note(self) -> None:
        """Write a line where one is due: something changed, or some time has passed."""
        device = self._device
        status = (device.activity, device.fault_codes)
        if status == self._last and device.time_ns < self._due_ns:
            return
        self._last = status
        at_rest = device.activity is Activity.BRAKED
        self._due_ns = device.time_ns + (_INTERVAL_AT_REST_NS if at_rest else _INTERVAL_NS)
        position, velocity = device.true_motion
        numbers = [f"{value:.9g}" for value in (*position.tolist(), *velocity.tolist())]
        self._write(",".join([str(device.time_ns), device.activity.value, "+".join(device.fault_codes), *numbers]))

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _write(self, line: str) -> None:
        os.write(self._file, (line + "\n").encode())


PASS_NS = 2_000_000  # the drives are carried forward at least this often [ns]
PASS_AT_REST_NS = 20_000_000  # likewise while the arm is braked [ns]
LATE_NS = 6_000_000  # being later than this counts as an overrun [ns]
OLDEST_NS = 100_000_000  # a setpoint that claims to have been sent longer ago counts as sent this long ago [ns]

_PEER = struct.Struct("3i")


class _Host:
    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.buffer = messages.FrameBuffer()
        peer = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size)
        self.process: int = _PEER.unpack(peer)[0]  # at the other end, as the kernel knows it

    def send(self, frame: messages.Frame) -> None:
        """Send a reply whole, or give the connection up: a host that reads nothing must not block the device."""
        data = frame.encode()
        if self.connection.send(data) != len(data):
            raise messages.BrokenFrameError("the host does not read its replies")


class DeviceServer:
    """Runs a device against the monotonic clock.

    Every pass carries the device forward to the present. After a stall of the machine the device's clock does not jump:
    what the host asked meanwhile is answered first, then the time is made up for tick by tick, and the overrun counted.
    A host whose connection ends while it has the arm under power counts as silent: the watchdog's stop is carried out
    at once.

    `linger_s`: how long it goes on without a host [s].
    """

    def __init__(self, device: SimulatedDevice, listener: socket.socket, trace: TraceWriter, linger_s: float) -> None:
        listener.setblocking(False)
        self._device, self._listener, self._trace = device, listener, trace
        self._linger_ns = round(linger_s * 1e9)
        self._host: _Host | None = None
        self._alone_since_ns = time.monotonic_ns()
        self._finished = False
        self._overruns = self._largest_lag_ns = 0

    def finish(self) -> None:
        """End after the present pass; may be called from a signal handler."""
        self._finished = True

    def run(self) -> None:
        """Serve until asked to finish, or until nobody has been connected for the set time."""
        self._trace.note()
        while not self._finished:
            self._sleep()
            self._pass(time.monotonic_ns())
            if self._host is None and time.monotonic_ns() - self._alone_since_ns > self._linger_ns:
                break
        self._drop_host("the device is shutting down")

    def _sleep(self) -> None:
        interval = PASS_AT_REST_NS if self._device.activity is Activity.BRAKED else PASS_NS
        remaining = self._device.time_ns + interval - time.monotonic_ns()
        if remaining > 0:
            waiting = [self._listener] if self._host is None else [self._listener, self._host.connection]
            select.select(waiting, [], [], remaining * 1e-9)

    def _pass(self, now_ns: int) -> None:
        lag_ns = now_ns - self._device.time_ns
        if self._device.activity is not Activity.BRAKED and lag_ns > LATE_NS:
            self._overruns += 1
            self._largest_lag_ns = max(self._largest_lag_ns, lag_ns)
            self._serve()
        while (behind_ns := now_ns - self._device.time_ns) > LATE_NS and not self._finished:
            self._device.advance_to(now_ns - behind_ns + PASS_NS)
            self._trace.note()
            self._serve()
        self._device.advance_to(now_ns)
        self._serve()
        self._trace.note()

    def _serve(self) -> None:
        if self._host is not None:
            self._hear(self._host)
        self._accept()

    def _hear(self, host: _Host) -> None:
        try:
            data = host.connection.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop_host("the host's connection ended")
            return
        try:
            for frame in host.buffer.feed(data):
                host.send(self._answer(frame))
                if frame.kind is messages.FrameKind.GOODBYE:
                    self._drop_host("the host's connection ended")
                    return
        except (messages.BrokenFrameError, OSError) as error:
            self._drop_host(f"the host's connection broke: {error}")

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except (BlockingIOError, ConnectionAbortedError):
            return
        if self._host is not None:
            self._hear(self._host)  # it may have gone since it was last heard, before the new one came
        if self._host is None:
            self._host = _Host(connection)
            return
        held = DriverError.no_connection(
            f"the simulated arm is held by process {self._host.process}; end that run first"
        )
        with connection, contextlib.suppress(OSError):
            connection.setblocking(False)
            connection.send(messages.Frame(messages.FrameKind.ERROR, 0, messages.encode_error(held)).encode())

    def _drop_host(self, reason: str) -> None:
        """Close the connection; an arm under this host's command stops as if its watchdog had fired."""
        if self._host is not None:
            self._host.connection.close()
        self._host = None
        self._alone_since_ns = time.monotonic_ns()
        self._device.lose_host(reason)
        self._trace.note()

    def _answer(self, frame: messages.Frame) -> messages.Frame:
        """Carry out a request; whatever is wrong with it goes back as an error."""
        try:
            kind, body = self._carry_out(frame.kind, frame.body)
        except DriverError as error:
            kind, body = messages.FrameKind.ERROR, messages.encode_error(error)
        except messages.BadMessageError as error:
            refusal = DriverError.refusal(f"the device does not understand the request: {error}")
            kind, body = messages.FrameKind.ERROR, messages.encode_error(refusal)
        return messages.Frame(kind, frame.sequence, body)

    def _carry_out(self, kind: messages.FrameKind, body: bytes) -> tuple[messages.FrameKind, bytes]:
        device = self._device
        match kind:
            case messages.FrameKind.HELLO:
                return messages.FrameKind.WELCOME, self._welcome(body)
            case messages.FrameKind.STATUS:
                report = {"activity": device.activity.value, "time_ns": device.time_ns, "overruns": self._overruns}
                report["largest_lag_ns"] = self._largest_lag_ns
                return messages.FrameKind.REPORT, messages.encode_document(report)
            case messages.FrameKind.EXCHANGE:
                sent_ns, setpoint = messages.decode_setpoint(body, device.capabilities.joint_count)
                now_ns = time.monotonic_ns()
                device.command(setpoint, min(max(sent_ns, device.time_ns, now_ns - OLDEST_NS), now_ns))
            case messages.FrameKind.ENABLE:
                device.enable(*messages.decode_enable(body))
            case messages.FrameKind.STOP:
                device.stop(messages.decode_document(StopPolicy, body))
            case messages.FrameKind.ACKNOWLEDGE:
                device.acknowledge_faults()
            case messages.FrameKind.INJECT:
                device.inject(messages.decode_document(Injection, body))
            case messages.FrameKind.PUT_BACK:
                device.put_back()
            case messages.FrameKind.GOODBYE:
                device.stop()
            case messages.FrameKind.READ:
                pass
            case _:
                raise messages.BadMessageError(f"{kind.name} is no request")
        return messages.FrameKind.STATE, messages.encode_state(device.read())

    def _welcome(self, body: bytes) -> bytes:
        if (asked := messages.decode_document(dict, body).get("protocol")) != messages.PROTOCOL:
            raise DriverError.no_connection(
                f"the device speaks version {messages.PROTOCOL}, not {asked!r}; use one Tauscope for both"
            )
        return messages.encode_document({"joint_count": self._device.capabilities.joint_count, "process": os.getpid()})
