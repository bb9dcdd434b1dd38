"""Traffic and timing of an arm's cycle: as planned, and as found once the servos are reached."""

import os
from dataclasses import replace

from tauscope_drivers.dynamixel.bus_budget import BusTiming, CycleTraffic, largest_rate_hz
from tauscope_drivers.dynamixel.configuration import BusConfiguration
from tauscope_drivers.dynamixel.port import LEAST_LATENCY_S, read_latency_timer_ms
from tauscope_drivers.dynamixel.session import SHORTEST_RETURN_DELAY_S, Session

_PACED_GOAL_BYTES = 8


def has_room_for_speeds(traffic: CycleTraffic, timing: BusTiming, cycle_s: float) -> bool:
    """Whether a cycle is long enough to send each servo a speed with its goal.

    Parameters
    ----------
    cycle_s : float
        of the control loop [s]
    """
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
