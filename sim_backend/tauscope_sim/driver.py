"""The simulated arm behind the protocol of `drivers`: in virtual time, and in real time in a process of its own."""

import contextlib
import json
import os
import selectors
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tauscope.robot import Robot, robot_to_dict
from tauscope_drivers import (
    ArmState,
    Capabilities,
    ControlMode,
    DriveLimits,
    DriverError,
    MonotonicClock,
    Setpoint,
    StopPolicy,
)
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.limits import require_finite
from tauscope_sim.device import SimulatedDevice, messages
from tauscope_sim.device.device import list_capabilities
from tauscope_sim.device.faults import Injection
from tauscope_sim.own_process import process_environment
from tauscope_sim.scenario import Scenario


class VirtualClock:
    """The clock of a simulated device. `start_ns`: first instant; `advance`: lets the device live up to one [ns]."""

    def __init__(self, start_ns: int, advance: Callable[[int], None]) -> None:
        self._now_ns = start_ns
        self._advance = advance

    def now_ns(self) -> int:
        """The present instant [ns]."""
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Let the device live up to a deadline, and return there; at once where it has passed."""
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns
            self._advance(deadline_ns)
        return self._now_ns


class SimulatedArm:
    """A backend whose clock carries the device forward, which keeps its place and faults while disconnected.

    `start_position`: (n,), None: `tauscope_sim.device.mechanism.resting_posture` [rad or m]. Raises as
    `SimulatedDevice` does.
    """

    def __init__(
        self, robot: Robot, scenario: Scenario | None = None, *, start_position: ArrayLike | None = None
    ) -> None:
        kept = Scenario() if scenario is None else scenario
        self.device = SimulatedDevice(robot, kept, start_position=start_position)
        """the drives and the arm, for tests and demonstrations"""
        self.capabilities = self.device.capabilities
        self.clock = VirtualClock(self.device.time_ns, self.device.advance_to)
        self._connected = False

    def connect(self) -> ArmState:
        """Reach the device and read it. Raises DriverError: ``cannot-connect`` where it is connected already."""
        if self._connected:
            raise DriverError.no_connection("the arm is connected already; disconnect it first")
        self._connected = True
        return self.device.read()

    def acknowledge_faults(self) -> ArmState:
        """Clear the latched faults; see `drivers.Backend`."""
        self._require_connection()
        self.device.acknowledge_faults()
        return self.device.read()

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power; see `drivers.Backend`. `watchdog_s`: without `exchange`, in virtual time [s]."""
        del cycle_s
        self._require_connection()
        self.device.enable(mode, limits, stop_policy, watchdog_s)
        return self.device.read()

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Write the setpoints, read the arm; see `drivers.Backend`."""
        self._require_connection()
        self.device.command(setpoint, self.clock.now_ns())
        return self.device.read()

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; legal at any time, also while disconnected."""
        self.device.stop(policy)
        return self.device.read()

    def disconnect(self) -> None:
        """Let go of the device; an arm that is still enabled is stopped by its own policy first."""
        self.device.stop()
        self._connected = False

    def _require_connection(self) -> None:
        if not self._connected:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the arm is not connected; connect it first")


START_TIMEOUT_S = 60.0  # time within which the process has to be ready [s]

_LONGEST_SOCKET_PATH = 107


@dataclass(frozen=True, eq=False)
class DeviceProcess(contextlib.AbstractContextManager["DeviceProcess"]):
    """A running device process."""

    process: "subprocess.Popen[bytes]"
    socket: Path
    trace: Path

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """Ask the process to end and wait for it; one that does not is killed."""
        self.process.terminate()
        try:
            self.process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def start_device(
    robot: Robot | Path,
    folder: Path,
    *,
    scenario: Path | None = None,
    start_position: Sequence[float] | None = None,
    linger_s: float = 60.0,
) -> DeviceProcess:
    """Start a simulated arm in real time, in a session of its own: signals to the caller's group do not reach it.

    Raises DriverError ``cannot-connect`` with the process's message. `start_position`: None: `resting_posture`;
    `linger_s`: without a host [s].
    """
    socket, trace, log = folder / "device.sock", folder / "device.csv", folder / "device.log"
    if len(os.fsencode(socket)) > _LONGEST_SOCKET_PATH:
        raise DriverError.no_connection(
            f"{socket}: longer than a socket's path can be; choose a folder with a shorter path"
        )
    command = [sys.executable, "-m", "tauscope_sim.device", "--linger", str(linger_s)]
    if isinstance(robot, Robot):
        plain, robot = robot_to_dict(robot), folder / "device-robot.json"
        robot.write_text(json.dumps(plain), encoding="utf-8")
    command += ["--robot", str(robot), "--socket", str(socket), "--trace", str(trace)]
    if scenario is not None:
        command += ["--scenario", str(scenario)]
    if start_position is not None:
        command += ["--start-position", json.dumps([float(number) for number in start_position])]
    with log.open("wb") as messages:
        process = subprocess.Popen(  # noqa: S603 (our own module with our own arguments)
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=messages,
            env=process_environment(),
            start_new_session=True,
        )
    device = DeviceProcess(process, socket, trace)
    _await_ready(device, log)
    return device


def _await_ready(device: DeviceProcess, log: Path) -> None:
    word = b""
    if (output := device.process.stdout) is not None:
        with output, selectors.DefaultSelector() as selector:
            selector.register(output, selectors.EVENT_READ)
            word = output.readline() if selector.select(START_TIMEOUT_S) else b""
    if word:
        return
    device.end()
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    reason = lines[-1].removeprefix("error: ") if lines else f"not ready within {START_TIMEOUT_S:.0f} s"
    raise DriverError.no_connection(f"the simulated arm's process did not start: {reason}")


LARGEST_RATE_HZ = 1000.0  # cycles a second that a connection carries with some time to spare [Hz]

_PATIENCE_S = 2.0


class RemoteSimulatedArm:
    """A backend that reaches the device process over its Unix socket; see `tauscope_sim.driver.start_device`.

    The device stops the arm when this process is killed, stopped or cut off. Without a reply within `reply_timeout_s`
    [s] the state of a cycle is not-a-number, and `ArmState.enabled` as last known.
    """

    def __init__(self, path: Path, joint_count: int, *, reply_timeout_s: float = 0.02) -> None:
        self._path, self._count, self._reply_timeout_s = path, joint_count, reply_timeout_s
        self.clock = MonotonicClock()
        self._socket: socket.socket | None = None
        self._buffer = messages.FrameBuffer()
        self._sequence = 0
        self._enabled = np.zeros(joint_count, dtype=np.bool_)

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        return list_capabilities(self._count, LARGEST_RATE_HZ)

    def connect(self) -> ArmState:
        """Reach the device and read it. Raises DriverError ``cannot-connect``: missing, taken, or of other joints."""
        if self._socket is not None:
            raise DriverError.no_connection("the arm is connected already; disconnect it first")
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connection.settimeout(_PATIENCE_S)
            connection.connect(str(self._path))
        except OSError as error:
            connection.close()
            raise DriverError.no_connection(
                f"{self._path}: no simulated arm answers there ({error.strerror}); start it"
            ) from error
        self._socket, self._buffer = connection, messages.FrameBuffer()
        try:
            hello = messages.encode_document({"protocol": messages.PROTOCOL, "process": os.getpid()})
            welcome = messages.decode_document(dict, self._request(messages.FrameKind.HELLO, hello).body)
            if welcome.get("joint_count") != self._count:
                raise DriverError.no_connection(
                    f"{self._path}: the simulated arm has {welcome.get('joint_count')} joints, the robot file "
                    f"{self._count}; start the device with this robot file"
                )
            return self._state_after(messages.FrameKind.READ)
        except (DriverError, messages.BadMessageError) as error:
            self._close()
            raise DriverError.no_connection(str(error)) from error

    def acknowledge_faults(self) -> ArmState:
        """Clear the latched faults; see `drivers.Backend`."""
        return self._state_after(messages.FrameKind.ACKNOWLEDGE)

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power where it stands; see `drivers.Backend`. `watchdog_s`: without `exchange` [s]."""
        del cycle_s
        asked = messages.encode_enable(mode, limits, stop_policy, watchdog_s)
        return self._state_after(messages.FrameKind.ENABLE, asked)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Write the setpoints, read the arm; see `drivers.Backend`."""
        require_finite(setpoint, self._count)
        body = messages.encode_setpoint(self.clock.now_ns(), setpoint)
        try:
            reply = self._request(messages.FrameKind.EXCHANGE, body, self._reply_timeout_s)
        except TimeoutError:
            return self._miss()
        return self._state_of(reply)

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm, which has done so itself where there is no connection. Raises DriverError ``lost``."""
        if self._socket is None:
            return self._miss()
        return self._state_after(messages.FrameKind.STOP, messages.encode_document(policy))

    def disconnect(self) -> None:
        """Let go of the device, which stops an arm that is still enabled by its own policy."""
        if self._socket is None:
            return
        with contextlib.suppress(DriverError):
            self._state_after(messages.FrameKind.GOODBYE)
        self._close()

    def status(self) -> dict[str, Any]:
        """What the device says of itself: ``activity``, ``time_ns``, ``overruns``, ``largest_lag_ns``."""
        return messages.decode_document(dict, self._patiently(messages.FrameKind.STATUS).body)

    def inject(self, injection: Injection) -> ArmState:
        """Make a disturbance happen, for a test."""
        return self._state_after(messages.FrameKind.INJECT, messages.encode_document(injection))

    def put_back(self) -> ArmState:
        """Have the arm carried back to where it began; see `tauscope_sim.device.SimulatedDevice.put_back`."""
        return self._state_after(messages.FrameKind.PUT_BACK)

    def _state_after(self, kind: messages.FrameKind, body: bytes = b"") -> ArmState:
        return self._state_of(self._patiently(kind, body))

    def _patiently(self, kind: messages.FrameKind, body: bytes = b"") -> messages.Frame:
        """Send a request outside the cycle; the device is lost if it takes longer than it ever should."""
        try:
            return self._request(kind, body)
        except TimeoutError as error:
            raise self._lose(f"no reply within {_PATIENCE_S:g} s") from error

    def _request(self, kind: messages.FrameKind, body: bytes, timeout_s: float = _PATIENCE_S) -> messages.Frame:
        """Send a request and wait for its reply; raises TimeoutError, and what the device refuses."""
        connection = self._require_connection()
        self._sequence = (self._sequence + 1) % 2**32
        deadline = time.monotonic() + timeout_s
        try:
            connection.settimeout(timeout_s)
            # A device that another host has says so and hangs up before it hears anything: its words can still be read.
            with contextlib.suppress(BrokenPipeError):
                connection.sendall(messages.Frame(kind, self._sequence, body).encode())
            reply = self._await_reply(connection, deadline)
        except TimeoutError:
            raise
        except (OSError, messages.BrokenFrameError) as error:
            raise self._lose(str(error)) from error
        if reply.kind is messages.FrameKind.ERROR:
            raise messages.decode_error(reply.body)
        return reply

    def _require_connection(self) -> socket.socket:
        if self._socket is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the arm is not connected; connect it first")
        return self._socket

    def _await_reply(self, connection: socket.socket, deadline: float) -> messages.Frame:
        """The reply to the last request; replies to those before it came too late and are passed over."""
        while (remaining := deadline - time.monotonic()) > 0.0:
            connection.settimeout(remaining)
            data = connection.recv(65536)
            if not data:
                raise ConnectionResetError("the device closed the connection")
            for frame in self._buffer.feed(data):
                refused_at_the_door = frame.sequence == 0 and frame.kind is messages.FrameKind.ERROR
                if frame.sequence == self._sequence or refused_at_the_door:
                    return frame
        raise TimeoutError

    def _state_of(self, reply: messages.Frame) -> ArmState:
        try:
            state = messages.decode_state(reply.body)
        except messages.BadMessageError as error:
            raise self._lose(str(error)) from error
        self._enabled = state.enabled
        return state

    def _miss(self) -> ArmState:
        return replace(ArmState.unknown(self.clock.now_ns(), self._count), enabled=self._enabled)

    def _lose(self, reason: str) -> DriverError:
        self._close()
        return DriverError(
            DriverErrorKind.LOST,
            f"{self._path}: the simulated arm's process is lost ({reason}); its watchdog stops the arm: connect again",
        )

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket = None
        self._enabled = np.zeros(self._count, dtype=np.bool_)
