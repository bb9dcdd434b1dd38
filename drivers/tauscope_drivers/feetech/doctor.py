"""Looks at a port and the servos on it, moves nothing, writes nothing, and says what to do about what it finds."""

import time
from collections.abc import Iterator, Sequence

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech.budget import cycle_parts, largest_part, largest_rate_hz
from tauscope_drivers.feetech.bus import FeetechBus
from tauscope_drivers.feetech.commissioning import find_doubts, read_servo, rehearse
from tauscope_drivers.feetech.configuration import BusConfiguration, read_configuration
from tauscope_drivers.feetech.neighbours import describe_device
from tauscope_drivers.feetech.registers import FEEDBACK, IDENTITY
from tauscope_drivers.feetech.servo import JointServo
from tauscope_drivers.feetech.session import Session, make_session, reach
from tauscope_drivers.inspection import Finding, FoundDevice, Severity, failure
from tauscope_drivers.limits import stated_limits
from tauscope_drivers.serial_adapters import latency_finding
from tauscope_drivers.serial_port import SerialPort

MEASURED_CYCLES = 50
"""Reads of which the loop rate is measured."""

USUAL_BAUDS = (1_000_000, 500_000, 250_000, 128_000, 115_200, 57_600, 38_400)
"""Rates that servos can be set to, the factory's first [bit/s]."""


def examine(joints: Sequence[DriveJoint], *, slack_s: float = 0.002) -> list[Finding]:
    """Port, adapter, and every servo that the robot file names.

    Raises DriverError: ``refused``: a ``drive`` block is not valid.
    """
    configuration = read_configuration(joints)
    port = SerialPort(configuration.port, configuration.baud, slack_s)
    try:
        port.open()
    except DriverError as error:
        return [failure(configuration.port, str(error))]
    try:
        findings = [Finding(Severity.GOOD, port.path, f"open at {port.baudrate} baud, locked for this program")]
        findings.append(latency_finding(port.path))
        return findings + _examine_servos(FeetechBus(port), configuration, joints)
    except DriverError as error:
        return [failure(configuration.port, str(error))]
    finally:
        port.close()


def _examine_servos(bus: FeetechBus, configuration: BusConfiguration, joints: Sequence[DriveJoint]) -> list[Finding]:
    findings: list[Finding] = []
    found: list[tuple[JointServo, dict[str, int]]] = []
    for number, wanted in enumerate(configuration.servos, 1):
        try:
            found.append(reach(bus, number, wanted))
        except DriverError as error:
            findings.append(failure(JointServo(number, wanted).label, str(error)))
    if len(found) < len(configuration.servos):
        return findings
    session = make_session(bus, found)
    for joint, described in enumerate(joints):
        servo, limits = session.servos[joint], stated_limits([described])
        reading, targets = read_servo(session, joint), session.read_targets(joint)
        findings += find_doubts(servo, reading, limits, targets)
        findings += rehearse(servo, reading, limits)
    return [*findings, _loop_rate(session)]


def _loop_rate(session: Session) -> Finding:
    """How often all servos can be read, measured, beside what a whole cycle allows."""
    bus, identifiers = session.bus, session.identifiers
    begin_ns = time.monotonic_ns()
    missed = sum(len(identifiers) - len(bus.sync_read(identifiers, FEEDBACK).statuses) for _ in range(MEASURED_CYCLES))
    rate_hz = MEASURED_CYCLES / ((time.monotonic_ns() - begin_ns) * 1e-9)
    parts = cycle_parts(len(identifiers), bus.port.baudrate, bus.return_delay_s, bus.port.latency_s)
    possible = f"a whole cycle gets {largest_rate_hz(parts):.0f} Hz at most: {largest_part(parts)}"
    detail = f"all servos read {rate_hz:.0f} times a second now; {possible}"
    if missed:
        answers = MEASURED_CYCLES * len(identifiers)
        remedy = "check cables, supply and the adapter"
        return Finding(Severity.WARNING, bus.port.path, f"{missed} of {answers} answers were missed; {detail}", remedy)
    return Finding(Severity.GOOD, bus.port.path, detail)


def scan_bus(path: str, bauds: Sequence[int] = USUAL_BAUDS, *, slack_s: float = 0.002) -> Iterator[FoundDevice]:
    """Every servo that answers a ping to all, one baud rate after the other; about a second each.

    Raises DriverError ``cannot-connect`` where the port is missing, not permitted or taken.
    """
    for baud in bauds:
        port = SerialPort(path, baud, slack_s)
        port.open()
        try:
            bus = FeetechBus(port)
            found = [(servo, bus.read(servo, IDENTITY)[1]) for servo in bus.ping_all()]
        finally:
            port.close()
        for servo, identity in found:
            firmware = f"{identity['Firmware Major Version']}.{identity['Firmware Minor Version']}"
            yield FoundDevice(servo, baud, describe_device(servo, identity), firmware)
