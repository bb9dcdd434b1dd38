"""What a cycle takes of the bus: a Sync Write of the goals, a (Fast) Sync Read of all servos, one servo's health."""

from dataclasses import replace
from typing import Any

from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.serial_port import expect_latency_s
from tauscope_drivers.serial_servos.budget import SHORTEST_RETURN_DELAY_S, BusTiming, CycleTraffic, largest_rate_hz
from tauscope_drivers.serial_servos.configuration import BusConfiguration

_SYNC_BYTES = 14
_STATUS_BYTES = 11
_FAST_BYTES = 8
_FAST_SERVO_BYTES = 4
_READ_BYTES = 14
_SPEED_BYTES = 4


def count_traffic(
    servos: int,
    *,
    state_bytes: int = 10,
    goal_bytes: int = 4,
    health_bytes: int = 3,
    fast: bool = False,
    families: int = 1,
) -> CycleTraffic:
    """A cycle of so many servos. `health_bytes`: that one servo is asked for besides; 0 for no such read [bytes]."""
    write = families * _SYNC_BYTES + servos * (1 + goal_bytes)
    ask = families * _SYNC_BYTES + servos
    answers = servos * (_STATUS_BYTES + state_bytes)
    if fast:
        answers = families * _FAST_BYTES + servos * (state_bytes + _FAST_SERVO_BYTES)
    health = _READ_BYTES + _STATUS_BYTES + health_bytes if health_bytes else 0
    return CycleTraffic(
        servos,
        write + ask + answers + health,
        (families if fast else servos) + bool(health_bytes),
        families + bool(health_bytes),
        "write Return Delay Time = 0",
    )


def has_room_for_speeds(traffic: CycleTraffic, timing: BusTiming, cycle_s: float) -> bool:
    """Whether a cycle is long enough to send each servo a speed with its goal."""
    more = traffic.servos * _SPEED_BYTES
    return largest_rate_hz(replace(traffic, bytes=traffic.bytes + more), timing) * cycle_s >= 1.0


def planned_budget(configuration: BusConfiguration[Any]) -> tuple[CycleTraffic, BusTiming]:
    """Before the servos are reached: with what they will be set to."""
    timing = BusTiming(configuration.baud, SHORTEST_RETURN_DELAY_S, expect_latency_s(configuration.port))
    return count_traffic(len(configuration.servos)), timing


def found_budget(session: Session) -> tuple[CycleTraffic, BusTiming]:
    """Of servos that were reached."""
    port = session.bus.port
    longest = max(block.length for servo in session.servos for block in servo.model.watched_blocks)
    traffic = count_traffic(
        len(session.servos), health_bytes=longest, fast=session.group.fast, families=session.group.family_count
    )
    return traffic, BusTiming(port.baudrate, session.bus.return_delay_s, port.latency_s)
