"""How many cycles a second a bus of servos carries, and what limits it.

T = bytes · 10/baud + answers · return delay + reads · latency of the adapter, for an adapter passes a part-filled
packet on only when its latency timer ends.
"""

from dataclasses import dataclass

from tauscope_drivers.errors import DriverError
from tauscope_drivers.serial_port import BITS_PER_BYTE

LARGEST_LOAD = 0.85
"""Share of a cycle that the bus may take; the rest is for the servos' own turnaround and for the host."""

RETURN_DELAY_UNIT_S = 2e-6  # one unit of Return Delay Time [s]
SHORTEST_RETURN_DELAY_S = 2e-6  # of a servo whose Return Delay Time is 0 [s]


@dataclass(frozen=True)
class CycleTraffic:
    """What goes over the bus in one cycle."""

    servos: int
    bytes: int  # without stuffing; `answers`: packets that wait for a return delay; `reads`: that wait for the adapter
    answers: int
    reads: int
    delay_remedy: str  # what to do about a long return delay


@dataclass(frozen=True)
class BusTiming:
    """How fast a bus is."""

    baud: float
    return_delay_s: float  # largest Return Delay Time of the servos [s]
    latency_s: float  # latency timer of the adapter; 0 on a plain serial line [s]


def cycle_parts(traffic: CycleTraffic, timing: BusTiming) -> dict[str, float]:
    """Time of one cycle by what takes it [s]."""
    return {
        f"the wire at {timing.baud:g} baud": traffic.bytes * BITS_PER_BYTE / timing.baud,
        f"a Return Delay Time of {timing.return_delay_s * 1e6:.0f} µs": traffic.answers * timing.return_delay_s,
        f"the adapter's latency timer of {timing.latency_s * 1e3:g} ms": traffic.reads * timing.latency_s,
    }


def largest_rate_hz(traffic: CycleTraffic, timing: BusTiming, load: float = LARGEST_LOAD) -> float:
    """Most cycles a second [Hz]."""
    return load / sum(cycle_parts(traffic, timing).values())


def require_rate(rate_hz: float, traffic: CycleTraffic, timing: BusTiming) -> None:
    """Refuse a rate that the bus does not carry, and say what limits it.

    Raises DriverError ``refused``, which names the limit and the rate that is possible.
    """
    most = largest_rate_hz(traffic, timing)
    if rate_hz <= most:
        return
    reason, remedy = largest_part(traffic, timing)
    raise DriverError.refusal(
        f"{rate_hz:g} Hz: {reason} and {traffic.servos} servos get {most:.0f} Hz at most; {remedy}, or ask for less"
    )


def largest_part(traffic: CycleTraffic, timing: BusTiming) -> tuple[str, str]:
    """What takes most of a cycle, and what to do about it."""
    parts = cycle_parts(traffic, timing)
    longest = max(parts, key=parts.__getitem__)
    remedies = "use a higher baud rate", traffic.delay_remedy, "write 1 to its latency_timer in /sys/class/tty"
    return f"{longest} takes {parts[longest] * 1e3:.2f} ms of each cycle", remedies[list(parts).index(longest)]
