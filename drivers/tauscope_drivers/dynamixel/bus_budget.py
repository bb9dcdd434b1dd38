"""What a cycle takes of the bus: a Sync Write of the goals, a (Fast) Sync Read of all servos, one servo's health."""

from dataclasses import dataclass, replace
from typing import Any

from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.serial_port import expect_latency_s
from tauscope_drivers.serial_servos.budget import SHORTEST_RETURN_DELAY_S, BusTiming, largest_rate_hz
from tauscope_drivers.serial_servos.configuration import BusConfiguration

_SYNC_BYTES = 14
_STATUS_BYTES = 11
_FAST_BYTES = 8
_FAST_SERVO_BYTES = 4
_READ_BYTES = 14
_PACED_GOAL_BYTES = 8


@dataclass(frozen=True)
class DynamixelTraffic:
    """What goes over the bus in one cycle.

    `health_bytes`: that one servo is asked for besides; 0 for no such read [bytes].
    """

    servos: int
    state_bytes: int = 10
    goal_bytes: int = 4
    health_bytes: int = 3
    fast: bool = False
    families: int = 1
    delay_remedy: str = "write Return Delay Time = 0"

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


def has_room_for_speeds(traffic: DynamixelTraffic, timing: BusTiming, cycle_s: float) -> bool:
    """Whether a cycle is long enough to send each servo a speed with its goal."""
    return largest_rate_hz(replace(traffic, goal_bytes=_PACED_GOAL_BYTES), timing) * cycle_s >= 1.0


def planned_budget(configuration: BusConfiguration[Any]) -> tuple[DynamixelTraffic, BusTiming]:
    """Before the servos are reached: with what they will be set to."""
    timing = BusTiming(configuration.baud, SHORTEST_RETURN_DELAY_S, expect_latency_s(configuration.port))
    return DynamixelTraffic(len(configuration.servos)), timing


def found_budget(session: Session) -> tuple[DynamixelTraffic, BusTiming]:
    """Of servos that were reached."""
    port = session.bus.port
    longest = max(block.length for servo in session.servos for block in servo.model.watched_blocks)
    traffic = DynamixelTraffic(
        len(session.servos), health_bytes=longest, fast=session.group.fast, families=session.group.family_count
    )
    return traffic, BusTiming(port.baudrate, session.bus.return_delay_s, port.latency_s)
