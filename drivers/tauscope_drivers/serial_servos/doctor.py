"""Looks at a port and the servos on it, moves nothing, writes nothing, and says what to do about what it finds."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Any, TypeVar

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, FoundDevice, Severity, failure
from tauscope_drivers.serial_port import SerialPort, latency_finding
from tauscope_drivers.serial_servos.bus import (
    Answers,
    BusTiming,
    CycleTraffic,
    SerialServoBus,
    largest_part,
    largest_rate_hz,
)
from tauscope_drivers.serial_servos.configuration import BusConfiguration

MEASURED_CYCLES = 50  # reads of which the loop rate is measured

_Servo = TypeVar("_Servo")
_Bus = TypeVar("_Bus", bound=SerialServoBus[Any])


def examine_bus(
    read_configuration: Callable[[Sequence[DriveJoint]], BusConfiguration[_Servo]],
    make_bus: Callable[[SerialPort], _Bus],
    examine_servos: Callable[[_Bus, Sequence[_Servo], Sequence[DriveJoint]], list[Finding]],
    joints: Sequence[DriveJoint],
    *,
    slack_s: float = 0.002,
) -> list[Finding]:
    """Port, adapter, and every servo of the robot file. Raises DriverError ``refused``: an invalid block."""
    configuration = read_configuration(joints)
    try:
        with closing(SerialPort(configuration.port, configuration.baud, slack_s)) as port:
            port.open()
            opened = Finding(Severity.GOOD, port.path, f"open at {port.baudrate} baud, locked for this program")
            found = examine_servos(make_bus(port), configuration.servos, joints)
            return [opened, latency_finding(port.path), *found]
    except DriverError as error:
        return [failure(configuration.port, str(error))]


def measure_loop_rate(
    bus: SerialServoBus[Any], ask: Callable[[], Answers[Any]], traffic: CycleTraffic, return_delay_s: float
) -> Finding:
    """How often all servos can be read, beside what a cycle allows. `ask`: reads all once; `return_delay_s`: [s]."""
    begin_ns = time.monotonic_ns()
    missed = sum(traffic.servos - len(ask().statuses) for _ in range(MEASURED_CYCLES))
    rate_hz = MEASURED_CYCLES / ((time.monotonic_ns() - begin_ns) * 1e-9)
    timing = BusTiming(bus.port.baudrate, return_delay_s, bus.port.latency_s)
    limit = f"{largest_rate_hz(traffic, timing):.0f} Hz at most: {', '.join(largest_part(traffic, timing))}"
    detail = f"all servos read {rate_hz:.0f} times a second now; a whole cycle gets {limit}"
    if missed:
        answers = MEASURED_CYCLES * traffic.servos
        remedy = "check cables, termination, supply and the adapter"
        return Finding(Severity.WARNING, bus.port.path, f"{missed} of {answers} answers were missed; {detail}", remedy)
    return Finding(Severity.GOOD, bus.port.path, detail)


def scan_bauds(
    usual: Sequence[int],
    make_bus: Callable[[SerialPort], _Bus],
    list_servos: Callable[[_Bus], list[tuple[int, str, str]]],
    path: str,
    bauds: Sequence[int] | None = None,
    *,
    slack_s: float = 0.002,
) -> Iterator[FoundDevice]:
    """Who answers a ping to all at each of `bauds`, or the `usual` ones. Raises DriverError ``cannot-connect``."""
    for baud in bauds or usual:
        with closing(SerialPort(path, baud, slack_s)) as port:
            port.open()
            found = list_servos(make_bus(port))
        for servo, model, firmware in found:
            yield FoundDevice(servo, baud, model, firmware)
