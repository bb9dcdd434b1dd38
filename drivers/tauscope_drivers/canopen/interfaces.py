"""Opening any interface that python-can knows, fit for a control loop, and claiming one that several may open."""

import errno
import socket
import struct
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import can

from tauscope_drivers.canopen.serial_adapter import SerialAdapterBus

ONE_PROCESS = ("slcan", "virtual")
"""Interfaces that two programs cannot drive at once: a port that is locked, and a bus inside of one process."""

OWN_OPTIONS = ("interface", "channel", "bitrate")
"""What python-can is told by keys of their own."""

_DAEMON = "socketcand"
_DAEMON_PORT = 29536
_CONNECT_S = 3.0


def open_interface(interface: str, channel: str, bit_rate: int, options: Mapping[str, Any]) -> can.BusABC:
    """An interface by the name that python-can knows it by.

    Raises can.CanError, OSError, ValueError, NotImplementedError, ImportError, TypeError where it is not there, not
    permitted, taken, or needs an option that it was not given.
    """
    if interface == "slcan":
        if options:
            raise ValueError(f"slcan takes no options, and was given {', '.join(options)}")
        return SerialAdapterBus(channel, bit_rate)
    if interface == _DAEMON:
        return _open_daemon(channel, bit_rate, options)
    return can.Bus(interface=interface, channel=channel, bitrate=bit_rate, **options)


def _open_daemon(channel: str, bit_rate: int, options: Mapping[str, Any]) -> can.BusABC:
    """A bus of another machine, by its socketcand.

    Without ``tcp_tune`` a frame waits until the one before is acknowledged: three of four cycles have no answer then.
    """
    known = {**can.util.load_config(config={"interface": _DAEMON, "channel": channel}), **options}
    if "host" not in known:
        raise ValueError("it needs the host of the daemon: options: {host: NAME}")
    host, port = str(known["host"]), int(known.get("port", _DAEMON_PORT))
    # python-can tries for ten seconds without a pause, and writes a line for each attempt
    socket.create_connection((host, port), _CONNECT_S).close()
    tuned = {"tcp_tune": sys.platform == "linux", **options, "host": host, "port": port}
    return can.Bus(interface=_DAEMON, channel=channel, bitrate=bit_rate, **tuned)


_PEER = struct.Struct("3i")
"""The kernel's ``struct ucred``: process, user, group."""


class ClaimedError(Exception):
    """Another process has the claim; the message names it."""


class BusClaim:
    """Held from construction until `release`, or until the process ends, however it ends.

    It is the name of a socket in the abstract namespace, which the kernel keeps for one process of this machine.
    """

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
    """The process that has a name, as ``process 123 (name)``."""
    with socket.socket(socket.AF_UNIX) as visitor:
        visitor.setblocking(False)
        try:
            visitor.connect(name)
            process, _, _ = _PEER.unpack(visitor.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size))
            command = Path("/proc", str(process), "comm").read_text(encoding="utf-8").strip()
        except OSError:
            return "another process"
    return f"process {process} ({command})"
