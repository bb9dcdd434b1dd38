"""How many cycles a second a CAN bus carries, worst-case bit stuffing included."""

from collections.abc import Sequence

LARGEST_LOAD = 0.8  # share of the bus that cyclic frames may take; the rest is for heartbeats, emergencies and SDOs

# characters of an 8-byte frame in the serial-line CAN protocol (slcan): ``t`` + 3 + 1 + 16 + return
ASCII_FRAME_BYTES = 22
HIGHEST_BIT_RATE = 1e6  # of classical CAN [bit/s]

_SYNC_BYTES = 0


def frame_bits(payload_bytes: int) -> int:
    """Longest form of a standard data frame: 47 + 8 d + ⌊(34 + 8 d − 1)/4⌋ bits for d bytes, interframe space included.

    `payload_bytes`: d, 0 to 8 [bytes].
    """
    return 47 + 8 * payload_bytes + (34 + 8 * payload_bytes - 1) // 4


def cycle_bits(nodes: int, payloads: Sequence[int]) -> int:
    """Bits of one cycle: SYNC and every node's PDOs. `payloads`: of the PDOs of one node [bytes]."""
    return frame_bits(_SYNC_BYTES) + nodes * sum(map(frame_bits, payloads))


def largest_rate_hz(nodes: int, payloads: Sequence[int], bit_rate: float, serial_baud: float | None = None) -> float:
    """Most cycles a second that the bus carries, and the adapter where it is a true serial line.

    `payloads`: of the PDOs of one node [bytes].
    `serial_baud`: of the adapter's serial line at 10 bits a byte [bit/s]; None where it is none (a USB CDC adapter
        ignores it).
    Returns float: [Hz].
    """
    bus_s = cycle_bits(nodes, payloads) / (LARGEST_LOAD * bit_rate)
    return 1.0 / max(bus_s, _serial_s(nodes, payloads, serial_baud))


def rate_limit(nodes: int, payloads: Sequence[int], bit_rate: float, serial_baud: float | None = None) -> str:
    """What limits the rate, the bus or the adapter's serial line, and what to do; arguments as of `largest_rate_hz`."""
    bus_s = cycle_bits(nodes, payloads) / bit_rate
    serial_s = _serial_s(nodes, payloads, serial_baud)
    if serial_s > bus_s / LARGEST_LOAD:
        line = f"the adapter's serial line of {serial_baud:g} baud"
        return f"{line} takes {serial_s * 1e3:.2f} ms of each cycle, use a faster adapter"
    bus = f"the frames of {nodes} drives take {bus_s * 1e3:.2f} ms of each cycle at {bit_rate / 1e3:g} kbit/s"
    remedy = ", use a higher bit rate" if bit_rate < HIGHEST_BIT_RATE else ""
    return f"{bus}, and {100 * (1 - LARGEST_LOAD):.0f} % of the bus are kept free{remedy}"


def _serial_s(nodes: int, payloads: Sequence[int], serial_baud: float | None) -> float:
    frames = 1 + nodes * len(payloads)
    return 0.0 if serial_baud is None else frames * ASCII_FRAME_BYTES * 10.0 / serial_baud
