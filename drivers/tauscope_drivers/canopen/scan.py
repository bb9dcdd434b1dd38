"""Who is on a CAN bus: every node is asked for its device type at once."""

import time
from collections.abc import Iterator, Sequence

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import CanBus
from tauscope_drivers.canopen.configuration import BusConfiguration
from tauscope_drivers.inspection import FoundDevice

USUAL_BIT_RATES = (1_000_000, 500_000, 250_000, 125_000)
"""Tried one after the other where the interface sets the rate [bit/s]."""

LISTENING_S = 0.3
"""Time in which all nodes answer."""

_FIXED_RATE = ("socketcan", "socketcand", "virtual", "udp_multicast")
"""Interfaces whose rate is set elsewhere."""

_NODES = range(1, 128)
_UPLOAD = 0x40
_PACING_S = 0.0005


def scan_bus(interface: str, channel: str, bit_rates: Sequence[int] | None = None) -> Iterator[FoundDevice]:
    """Every node that answers, one bit rate after the other.

    Reads the device type (0x1000) by service data, then name and version of those that answered. At a wrong bit rate
    this disturbs a bus that is in use: name the rate where anything moves.

    Parameters
    ----------
    bit_rates : sequence of int or None
        to try [bit/s]; the usual ones where None, one where the interface has a fixed one

    Raises
    ------
    DriverError
        ``cannot-connect``: the bus is missing, not permitted or taken
    """
    if bit_rates is None:
        bit_rates = USUAL_BIT_RATES[:1] if interface in _FIXED_RATE else USUAL_BIT_RATES
    for bit_rate in bit_rates:
        bus = CanBus(BusConfiguration((), interface, channel, bit_rate))
        try:
            for node, device_type in sorted(_answers(bus).items()):
                name, version = _name_and_version(bus, node)
                profile = f"profile {device_type & 0xFFFF}"
                yield FoundDevice(node, bit_rate, f"{name} ({profile})" if name else profile, version)
        finally:
            bus.close()


def _answers(bus: CanBus) -> dict[int, int]:
    """Device type of every node that answers."""
    found: dict[int, int] = {}

    def take(identifier: int, data: bytes) -> None:
        if len(data) == 8 and data[1:4] == bytes([0x00, 0x10, 0x00]) and data[0] & 0xE0 == _UPLOAD:
            found[identifier - 0x580] = int.from_bytes(data[4:8], "little")

    for node in _NODES:
        bus.subscribe(0x580 + node, take)
    for node in _NODES:
        bus.send(0x600 + node, bytes([_UPLOAD, 0x00, 0x10, 0, 0, 0, 0, 0]))
        bus.receive(time.monotonic_ns() + round(_PACING_S * 1e9))
    deadline = time.monotonic_ns() + round(LISTENING_S * 1e9)
    while time.monotonic_ns() < deadline:
        bus.receive(deadline)
    return found


def _name_and_version(bus: CanBus, node: int) -> tuple[str, str]:
    """Device name (0x1008) and software version (0x100A); empty where it tells none."""
    dictionary = bus.add_node(node)
    return dictionary.read_text(objects.DEVICE_NAME), dictionary.read_text(objects.SOFTWARE_VERSION)
