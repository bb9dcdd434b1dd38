"""Opening any interface that python-can knows, fit for a control loop, and claiming one that several may open."""

import contextlib
import errno
import re
import select
import socket
import struct
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import can
from can import CanInitializationError, CanOperationError
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus

from tauscope_drivers.serial_port import find_holder

# interfaces that two programs cannot drive at once: a port that is locked, and a bus inside of one process
ONE_PROCESS = ("slcan", "virtual")
OWN_OPTIONS = ("interface", "channel", "bitrate")  # what python-can is told by keys of their own

_DAEMON = "socketcand"
_DAEMON_PORT = 29536
_CONNECT_S = 3.0


def open_interface(interface: str, channel: str, bit_rate: int, options: Mapping[str, Any]) -> can.BusABC:
    """An interface by its name in python-can. Raises CanError, OSError, ValueError, TypeError, or ImportError."""
    if interface == "slcan":
        if options:
            raise ValueError(f"slcan takes no options, and was given {', '.join(options)}")
        return SerialAdapterBus(channel, bit_rate)
    if interface == _DAEMON:
        return _open_daemon(channel, bit_rate, options)
    return can.Bus(interface=interface, channel=channel, bitrate=bit_rate, **options)


def _open_daemon(channel: str, bit_rate: int, options: Mapping[str, Any]) -> can.BusABC:
    """A bus of another machine. Without ``tcp_tune`` a frame waits for the last one: most cycles lose theirs."""
    known = {**can.util.load_config(config={"interface": _DAEMON, "channel": channel}), **options}
    if "host" not in known:
        raise ValueError("it needs the host of the daemon: options: {host: NAME}")
    host, port = str(known["host"]), int(known.get("port", _DAEMON_PORT))
    # python-can tries for ten seconds without a pause, and writes a line for each attempt
    socket.create_connection((host, port), _CONNECT_S).close()
    tuned = {"tcp_tune": sys.platform == "linux", **options, "host": host, "port": port}
    return can.Bus(interface=_DAEMON, channel=channel, bitrate=bit_rate, **tuned)


_PEER = struct.Struct("3i")  # the kernel's ``struct ucred``: process, user, group


class ClaimedError(Exception):
    """Another process has the claim; the message names it."""


class BusClaim:
    """Held until `release`, or the process's end: the name of a socket, which the kernel keeps for one process."""

    def __init__(self, interface: str) -> None:
        """Claim. Raises ClaimedError where another process has it."""
        name = f"\0tauscope-can-{interface}"
        self._socket = socket.socket(socket.AF_UNIX)
        try:
            self._socket.bind(name)
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise ClaimedError(_holder(name)) from error
        self._socket.listen(1)

    def release(self) -> None:
        """Let another process have it."""
        self._socket.close()


def _holder(name: str) -> str:
    with socket.socket(socket.AF_UNIX) as visitor:
        visitor.setblocking(False)
        try:
            visitor.connect(name)
            process, _, _ = _PEER.unpack(visitor.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size))
            command = Path("/proc", str(process), "comm").read_text(encoding="utf-8").strip()
        except OSError:
            return "another process"
    return f"process {process} ({command})"


RESTART_S = 2.0  # time that an adapter takes to restart after its port was opened, as python-can has it

_VERSION_S = 0.1
_ACKNOWLEDGEMENTS = ("\r", "z\r", "Z\r")
_FRAME_LETTERS = "tTrRxdDbB"
_FRAME = re.compile(r"(?:t[0-7][0-9A-F]{2}|T[01][0-9A-F]{7})(?P<bytes>[0-8])(?P<data>[0-9A-F]*)\r", re.IGNORECASE)
_STAMP_DIGITS = 4  # of the time that some adapters write behind a frame


class SerialAdapterBus(slcanBus):
    """`can.interfaces.slcan.slcanBus` that takes many frames with one call, and shares its port with nobody."""

    _gathered: bytearray | None = None

    def __init__(self, path: str, bit_rate: int) -> None:
        """Open adapter and channel. Raises CanInitializationError: no port, not permitted, or who has it."""
        holder = find_holder(path)
        if holder is not None:
            raise CanInitializationError(f"{holder} has it")
        super().__init__(path, bitrate=bit_rate, sleep_after_open=0.0)
        try:
            self.serialPortOrig.exclusive = True
        except OSError as error:
            self.shutdown()
            raise CanInitializationError(f"{find_holder(path) or 'another program'} has it") from error
        self._await_adapter()
        self.set_bitrate(bit_rate)

    @contextlib.contextmanager
    def gathering(self) -> Iterator[None]:
        """Send what is sent within the context with one write on leaving it. Raises CanOperationError: not taken."""
        self._gathered = bytearray()
        try:
            yield
            text = bytes(self._gathered)
        finally:
            self._gathered = None
        self._put(text)

    def shutdown(self) -> None:
        """Close the channel and the port; of an adapter that is gone only the port is left to close."""
        with contextlib.suppress(CanOperationError):
            super().shutdown()
        self.serialPortOrig.close()

    def _await_adapter(self) -> None:
        """Until it tells its version: some restart when they are opened, and some never tell."""
        deadline = time.monotonic() + RESTART_S
        while time.monotonic() < deadline:
            with contextlib.suppress(ValueError):
                if self.get_version(_VERSION_S)[0] is not None:
                    return

    def _write(self, string: str) -> None:
        """One line for the adapter, at once or when the context of `gathering` is left."""
        line = string.encode() + self.LINE_TERMINATOR
        if self._gathered is None:
            self._put(line)
        else:
            self._gathered += line

    def _put(self, text: bytes) -> None:
        with error_check("Could not write to serial device"):
            self.serialPortOrig.write(text)

    def _read(self, timeout: float | None) -> str | None:
        """One line of the adapter, without waiting where one is there already."""
        line = self._next_line()
        if line is None:
            port = self.serialPortOrig
            waiting = port.in_waiting
            if not waiting:
                # the port's own timeout is a setting of the terminal, which takes longer to change than to read
                if not select.select([port], [], [], timeout)[0]:
                    return None
                waiting = max(1, port.in_waiting)  # of a port that is gone the read fails
            self._buffer.extend(port.read(waiting))
            line = self._next_line()
        return line

    def _next_line(self) -> str | None:
        """The first whole line that says something: no acknowledgement, no frame that lacks characters."""
        while ends := [place for mark in (self._OK, self._ERROR) if (place := self._buffer.find(mark)) >= 0]:
            end = min(ends) + 1
            line = self._buffer[:end].decode("ascii", "replace")
            del self._buffer[:end]
            if line not in _ACKNOWLEDGEMENTS and _is_sound(line):
                return line
        return None


def _is_sound(line: str) -> bool:
    """Whether a line is no frame, or a whole data frame: an adapter whose buffer overflows leaves characters out."""
    if line[0] not in _FRAME_LETTERS:
        return True
    frame = _FRAME.fullmatch(line)
    return frame is not None and len(frame["data"]) - 2 * int(frame["bytes"]) in (0, _STAMP_DIGITS)
