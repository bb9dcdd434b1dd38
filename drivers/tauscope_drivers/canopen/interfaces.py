"""Opening any interface that python-can knows, with what it needs to be fit for a control loop."""

import socket
import sys
from collections.abc import Mapping
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

    Parameters
    ----------
    bit_rate : int
        [bit/s]

    Raises
    ------
    can.CanError, OSError, ValueError, NotImplementedError, ImportError, TypeError
        it is not there, not permitted, taken, or needs an option that it was not given
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
