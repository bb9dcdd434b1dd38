"""How many cycles a second a bus of servos carries, and what limits it.

A cycle is one Sync Write of the goals, one (Fast) Sync Read of all servos and one read of one servo's health:
T = bytes · 10/baud + answers · return delay + reads · latency of the adapter, for an adapter passes a part-filled
packet on only when its latency timer ends.
"""

import os
from dataclasses import dataclass, replace

from tauscope_drivers.dynamixel.configuration import BusConfiguration
from tauscope_drivers.dynamixel.session import SHORTEST_RETURN_DELAY_S, Session
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.serial_port import BITS_PER_BYTE, LEAST_LATENCY_S, read_latency_timer_ms

LARGEST_LOAD = 0.85
"""Share of a cycle that the bus may take; the rest is for the servos' own turnaround and for the host."""

_SYNC_BYTES = 14
_STATUS_BYTES = 11
_FAST_BYTES = 8
_FAST_SERVO_BYTES = 4
_READ_BYTES = 14


@dataclass(frozen=True)
class CycleTraffic:
    """What goes over the bus in one cycle.

    `health_bytes`: that one servo is asked for besides; 0 for no such read [bytes].
    """

    servos: int
    state_bytes: int = 10
    goal_bytes: int = 4
    health_bytes: int = 3
    fast: bool = False
    families: int = 1

    @property
    def bytes(self) -> int:
        """All bytes of a cycle, without stuffing."""
        n = self.servos
        write = self.families * _SYNC_BYTES + n * (1 + self.goal_bytes)
        ask = self.families * _SYNC_BYTES + n
        if self.fast:
            answers = self.families * _FAST_BYTES + n * (self.state_bytes + _FAST_SERVO_BYTES)
        else:
            answers = n * (_STATUS_BYTES + self.state_bytes)
        health = _READ_BYTES + _STATUS_BYTES + self.health_bytes if self.health_bytes else 0
        return write + ask + answers + health

    @property
    def answers(self) -> int:
        """Packets that wait for a return delay."""
        return (self.families if self.fast else self.servos) + (1 if self.health_bytes else 0)

    @property
    def reads(self) -> int:
        """Reads that wait for the adapter."""
        return self.families + (1 if self.health_bytes else 0)


@dataclass(frozen=True)
class BusTiming:
    """How fast a bus is.

    `return_delay_s`: largest Return Delay Time of the servos [s].
    `latency_s`: latency timer of the adapter; 0 on a plain serial line [s].
    """

    baud: float
    return_delay_s: float
    latency_s: float


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
    raise DriverError(
        DriverErrorKind.REFUSED,
        f"{rate_hz:g} Hz: {reason} and {traffic.servos} servos get {most:.0f} Hz at most; {remedy}, or ask for less",
    )


def largest_part(traffic: CycleTraffic, timing: BusTiming) -> tuple[str, str]:
    """What takes most of a cycle, and what to do about it."""
    parts = cycle_parts(traffic, timing)
    longest = max(parts, key=parts.__getitem__)
    return f"{longest} takes {parts[longest] * 1e3:.2f} ms of each cycle", _REMEDIES[list(parts).index(longest)]


_REMEDIES = (
    "use a higher baud rate",
    "write Return Delay Time = 0",
    "write 1 to its latency_timer in /sys/class/tty",
)


_PACED_GOAL_BYTES = 8


def has_room_for_speeds(traffic: CycleTraffic, timing: BusTiming, cycle_s: float) -> bool:
    """Whether a cycle is long enough to send each servo a speed with its goal."""
    return largest_rate_hz(replace(traffic, goal_bytes=_PACED_GOAL_BYTES), timing) * cycle_s >= 1.0


def planned_budget(configuration: BusConfiguration) -> tuple[CycleTraffic, BusTiming]:
    """Before the servos are reached: with what they will be set to."""
    latency_ms = read_latency_timer_ms(configuration.port)
    exists = os.path.exists(configuration.port)
    latency_s = LEAST_LATENCY_S if latency_ms is None and exists else (latency_ms or 1) * 1e-3
    timing = BusTiming(configuration.baud, SHORTEST_RETURN_DELAY_S, latency_s)
    return CycleTraffic(len(configuration.servos)), timing


def found_budget(session: Session) -> tuple[CycleTraffic, BusTiming]:
    """Of servos that were reached."""
    port = session.bus.port
    longest = max(block.length for servo in session.servos for block in servo.model.watched_blocks)
    traffic = CycleTraffic(
        len(session.servos),
        health_bytes=longest,
        fast=session.group.fast,
        families=session.group.family_count,
    )
    return traffic, BusTiming(port.baudrate, session.bus.return_delay_s, port.latency_s)
