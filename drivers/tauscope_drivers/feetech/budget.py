"""How many cycles a second a bus of servos carries, and what limits it.

A cycle is one Sync Write of the goals, one Sync Read of all servos and one read of one servo's torque and limits:
T = bytes · 10/baud + answers · return delay + 2 · latency of the adapter.
"""

import os

from tauscope_drivers.feetech.packets import ANSWER_BYTES
from tauscope_drivers.feetech.registers import FEEDBACK, TARGETS
from tauscope_drivers.serial_port import BITS_PER_BYTE, LEAST_LATENCY_S, read_latency_timer_ms

LARGEST_LOAD = 0.85
"""Share of a cycle that the bus may take; the rest is for the servos' own turnaround and for the host."""

_ASK_BYTES = 8
_GOAL_BYTES = 7
"""ID, position, time and speed."""


def cycle_parts(servos: int, baud: float, return_delay_s: float, latency_s: float) -> dict[str, float]:
    """Time of one cycle by what takes it [s]."""
    count = 3 * _ASK_BYTES + servos * (_GOAL_BYTES + 1 + ANSWER_BYTES + FEEDBACK.length)
    count += ANSWER_BYTES + TARGETS.length
    return {
        f"the wire at {baud:g} baud": count * BITS_PER_BYTE / baud,
        f"a Return Delay Time of {return_delay_s * 1e6:.0f} µs": (servos + 1) * return_delay_s,
        f"the adapter's latency timer of {latency_s * 1e3:g} ms": 2.0 * latency_s,
    }


def largest_rate_hz(parts: dict[str, float]) -> float:
    """Most cycles a second [Hz]."""
    return LARGEST_LOAD / sum(parts.values())


def largest_part(parts: dict[str, float]) -> str:
    """What takes most of a cycle, and what to do about it."""
    longest = max(parts, key=parts.__getitem__)
    remedy = _REMEDIES[list(parts).index(longest)]
    return f"{longest} takes {parts[longest] * 1e3:.2f} ms of each cycle, {remedy}"


_REMEDIES = (
    "use a higher baud rate",
    "set Return Delay Time to 0 with Feetech's FD",
    "write 1 to its latency_timer in /sys/class/tty",
)


def adapter_latency_s(path: str) -> float:
    """Latency of an adapter that is not open yet [s]."""
    latency_ms = read_latency_timer_ms(path)
    if latency_ms is None:
        return LEAST_LATENCY_S if os.path.exists(path) else 1e-3
    return max(LEAST_LATENCY_S, latency_ms * 1e-3)
