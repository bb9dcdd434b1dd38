"""How many cycles a second a CAN bus carries, worst-case bit stuffing included."""

from dataclasses import dataclass

LARGEST_LOAD = 0.8  # share of the bus that cyclic frames may take; the rest is for heartbeats, emergencies and SDOs

# characters of an 8-byte frame in the serial-line CAN protocol (slcan): ``t`` + 3 + 1 + 16 + return
ASCII_FRAME_BYTES = 22
HIGHEST_BIT_RATE = 1e6  # of classical CAN [bit/s]

_SYNC_BYTES = 0


@dataclass(frozen=True)
class CycleFrames:
    """Cyclic frames of one node."""

    received_bytes: tuple[int, ...]  # payloads of its RPDOs [bytes]
    sent_bytes: tuple[int, ...]  # payloads of its TPDOs [bytes]


def frame_bits(payload_bytes: int) -> int:
    """Longest form of a standard data frame: 47 + 8 d + ⌊(34 + 8 d − 1)/4⌋ bits for d bytes, interframe space included.

    `payload_bytes`: d, 0 to 8 [bytes].
    """
    return 47 + 8 * payload_bytes + (34 + 8 * payload_bytes - 1) // 4


def cycle_bits(nodes: int, frames: CycleFrames) -> int:
    """Bits of one cycle: SYNC and every node's PDOs."""
    node = sum(frame_bits(size) for size in (*frames.received_bytes, *frames.sent_bytes))
    return frame_bits(_SYNC_BYTES) + nodes * node


def largest_rate_hz(nodes: int, frames: CycleFrames, bit_rate: float, serial_baud: float | None = None) -> float:
    """Most cycles a second that the bus carries, and the adapter where it is a true serial line.

    `serial_baud`: of the adapter's serial line at 10 bits a byte [bit/s]; None where it is none (a USB CDC adapter
        ignores it).
    Returns float: [Hz].
    """
    bus_s = cycle_bits(nodes, frames) / (LARGEST_LOAD * bit_rate)
    return 1.0 / max(bus_s, _serial_s(nodes, frames, serial_baud))


def rate_limit(nodes: int, frames: CycleFrames, bit_rate: float, serial_baud: float | None = None) -> str:
    """What limits the rate, the bus or the adapter's serial line, and what to do about it.

    `serial_baud`: of the adapter's serial line [bit/s]; None where it is none.
    """
    bus_s = cycle_bits(nodes, frames) / bit_rate
    serial_s = _serial_s(nodes, frames, serial_baud)
    if serial_s > bus_s / LARGEST_LOAD:
        line = f"the adapter's serial line of {serial_baud:g} baud"
        return f"{line} takes {serial_s * 1e3:.2f} ms of each cycle, use a faster adapter"
    bus = f"the frames of {nodes} drives take {bus_s * 1e3:.2f} ms of each cycle at {bit_rate / 1e3:g} kbit/s"
    remedy = ", use a higher bit rate" if bit_rate < HIGHEST_BIT_RATE else ""
    return f"{bus}, and {100 * (1 - LARGEST_LOAD):.0f} % of the bus are kept free{remedy}"


def _serial_s(nodes: int, frames: CycleFrames, serial_baud: float | None) -> float:
    if serial_baud is None:
        return 0.0
    messages = 1 + nodes * (len(frames.received_bytes) + len(frames.sent_bytes))
    return messages * ASCII_FRAME_BYTES * 10.0 / serial_baud
