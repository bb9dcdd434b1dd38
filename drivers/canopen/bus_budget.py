"""How many cycles a second a CAN bus carries, worst-case bit stuffing included."""

from dataclasses import dataclass

from drivers.errors import DriverError, DriverErrorKind

LARGEST_LOAD = 0.8
"""Share of the bus that cyclic frames may take; the rest is for heartbeats, emergencies and service data."""

ASCII_FRAME_BYTES = 22
"""Characters of an 8-byte frame in the serial-line CAN protocol (slcan): ``t`` + 3 + 1 + 16 + return."""

_SYNC_BYTES = 0


@dataclass(frozen=True)
class CycleFrames:
    """Cyclic frames of one node.

    received_bytes : tuple of int
        payloads of its RPDOs [bytes]
    sent_bytes : tuple of int
        payloads of its TPDOs [bytes]
    """

    received_bytes: tuple[int, ...]
    sent_bytes: tuple[int, ...]


def frame_bits(payload_bytes: int) -> int:
    """Longest form of a standard data frame: 47 + 8 d + ⌊(34 + 8 d − 1)/4⌋ bits for d bytes, interframe space included.

    Parameters
    ----------
    payload_bytes : int
        d, 0 to 8 [bytes]
    """
    return 47 + 8 * payload_bytes + (34 + 8 * payload_bytes - 1) // 4


def cycle_bits(nodes: int, frames: CycleFrames) -> int:
    """Bits of one cycle: SYNC and every node's PDOs.

    Parameters
    ----------
    nodes : int
        number of nodes
    frames : CycleFrames
        of one node
    """
    node = sum(frame_bits(size) for size in (*frames.received_bytes, *frames.sent_bytes))
    return frame_bits(_SYNC_BYTES) + nodes * node


def largest_rate_hz(nodes: int, frames: CycleFrames, bit_rate: float, serial_baud: float | None = None) -> float:
    """Most cycles a second that the bus carries, and the adapter where it is a true serial line.

    Parameters
    ----------
    nodes : int
        number of nodes
    frames : CycleFrames
        of one node
    bit_rate : float
        of the bus [bit/s]
    serial_baud : float or None
        of the adapter's serial line at 10 bits a byte [bit/s]; None where it is none (a USB CDC adapter ignores it)

    Returns
    -------
    float
        [Hz]
    """
    bus = LARGEST_LOAD * bit_rate / cycle_bits(nodes, frames)
    if serial_baud is None:
        return bus
    messages = 1 + nodes * (len(frames.received_bytes) + len(frames.sent_bytes))
    return min(bus, serial_baud / 10.0 / (messages * ASCII_FRAME_BYTES))


def require_rate(
    rate_hz: float, nodes: int, frames: CycleFrames, bit_rate: float, serial_baud: float | None = None
) -> None:
    """Refuse a rate that the bus cannot carry, and say what limits it.

    Parameters
    ----------
    rate_hz : float
        wanted cycles a second [Hz]
    nodes : int
        number of nodes
    frames : CycleFrames
        of one node
    bit_rate : float
        of the bus [bit/s]
    serial_baud : float or None
        of the adapter's serial line [bit/s]; None where it is none

    Raises
    ------
    DriverError
        ``refused``: names the limit and the rate that is possible
    """
    most = largest_rate_hz(nodes, frames, bit_rate, serial_baud)
    if rate_hz <= most:
        return
    bus = largest_rate_hz(nodes, frames, bit_rate)
    if most < bus:
        limit, remedy = f"the adapter's serial line of {serial_baud:g} baud", "a faster adapter"
    else:
        limit, remedy = f"the bus at {bit_rate / 1e3:g} kbit/s with {nodes} nodes", "a higher bit rate or fewer PDOs"
    raise DriverError(
        DriverErrorKind.REFUSED, f"{rate_hz:g} Hz: {limit} carries at most {most:.0f} Hz; ask for less, or use {remedy}"
    )
