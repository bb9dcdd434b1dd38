"""Looks at the servos of a port, moves nothing, writes nothing, and says what to do about what it finds."""

import math
from collections.abc import Sequence
from functools import partial

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.bus import ServoBus, count_traffic
from tauscope_drivers.dynamixel.configuration import ServoConfiguration, read_configuration
from tauscope_drivers.dynamixel.control_table import WATCHDOG_MOST, WATCHDOG_STEP_S, describe_model
from tauscope_drivers.dynamixel.enabling import plan_tasks
from tauscope_drivers.dynamixel.health import Health, hardware_faults, watchdog_fault
from tauscope_drivers.dynamixel.preparation import ANSWERS_ALL, drive_mode, operating_mode
from tauscope_drivers.dynamixel.servo import JointServo, make_servo
from tauscope_drivers.dynamixel.session import Session, make_session, read_items, read_settings
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.inspection import Finding, Severity, failure
from tauscope_drivers.limits import stated_limits
from tauscope_drivers.serial_servos.bus import RETURN_DELAY_UNIT_S, SHORTEST_RETURN_DELAY_S
from tauscope_drivers.serial_servos.doctor import examine_bus, measure_loop_rate, scan_bauds

_SECONDARY = ("Secondary ID", "Secondary(Shadow) ID")
_MOST_TURNS = 256  # Goal Position reaches this many turns both ways

_EXAMINED = ("Torque Enable", "Bus Watchdog", *_SECONDARY)
_LEAST_FIRMWARE = 45  # of the X series for Fast Sync Read and all bits of Drive Mode


def _examine_servos(
    bus: ServoBus, wanted_servos: Sequence[ServoConfiguration], joints: Sequence[DriveJoint]
) -> list[Finding]:
    findings: list[Finding] = []
    servos: list[JointServo] = []
    found: list[dict[str, int]] = []
    for number, wanted in enumerate(wanted_servos, 1):
        subject = f"joint {wanted.joint} (servo {wanted.servo})"
        identity = bus.ping(wanted.servo)
        if identity is None:
            remedy = "check its power, cable, ID and baud rate; scan the bus to see who answers"
            findings.append(Finding(Severity.FAILURE, subject, "does not answer", remedy))
            continue
        try:
            servo = make_servo(number, wanted, identity)
            settings = read_settings(bus, servo)
            settings |= read_items(bus, servo, (*_EXAMINED, servo.model.error_item.name))
        except DriverError as error:
            answers_pings = error.kind is DriverErrorKind.CANNOT_CONNECT and bus.ping(wanted.servo)
            if answers_pings and bus.read_once(wanted.servo, 0, 1) is None:
                remedy = "set Status Return Level to 2 with the DYNAMIXEL Wizard"
                findings.append(Finding(Severity.FAILURE, subject, "answers pings and no reads", remedy))
            else:
                findings.append(failure(subject, str(error)))
            continue
        findings += _examine_servo(servo, settings)
        servos.append(servo)
        found.append(settings)
    if len(servos) == len(wanted_servos):
        findings += _examine_secondary(servos, found)
        findings += _rehearse(make_session(bus, servos, found), joints)
        bus.return_delay_s = max(settings["Return Delay Time"] for settings in found) * RETURN_DELAY_UNIT_S
        identifiers, block = [servo.servo for servo in servos], servos[0].model.state_block
        traffic = count_traffic(len(servos))
        ask = partial(bus.sync_read, identifiers, block)
        findings.append(measure_loop_rate(bus, ask, traffic, SHORTEST_RETURN_DELAY_S))
    return findings


def _rehearse(session: Session, joints: Sequence[DriveJoint]) -> list[Finding]:
    """Everything that a run checks before it writes, by the limits that the robot file states, joint by joint."""
    findings: list[Finding] = []
    for joint, described in enumerate(joints):
        servo, limits = session.servos[joint], stated_limits([described])
        alone = Session(session.bus, (servo,), [session.settings[joint]], session.group, Health([servo]))
        alone.health.has_torque[0] = session.health.has_torque[joint]
        try:
            plan_tasks(alone, ControlMode.POSITION, limits, WATCHDOG_STEP_S)
        except DriverError as error:
            findings.append(failure(servo.label, str(error)))
            findings += _turn_offset(alone, described)
        findings += _slow_servo(servo, session.settings[joint], described)
    return findings


def _turn_offset(session: Session, joint: DriveJoint) -> list[Finding]:
    servo = session.servos[0]
    counts = session.read(0, ["Present Position"])["Present Position"]
    turn = servo.model.counts_per_radian * 2.0 * math.pi
    low, high = joint.position_range or (-math.inf, math.inf)
    place = servo.units.position(counts)
    for turns in range(-_MOST_TURNS, _MOST_TURNS + 1):
        if turns and not low <= place <= high and low <= servo.units.position(counts - round(turns * turn)) <= high:
            detail = f"its multi-turn position is off by {turns} turn{'s' if abs(turns) > 1 else ''}"
            remedy = "support the arm and switch the servo's power off and on, or correct drive.zero_count"
            return [Finding(Severity.FAILURE, servo.label, detail, remedy)]
    return []


def _slow_servo(servo: JointServo, settings: dict[str, int], joint: DriveJoint) -> list[Finding]:
    own = settings.get("Velocity Limit", 0)
    wanted = 0 if joint.velocity_limit is None else servo.units.velocity_cap(joint.velocity_limit)
    if not own or own >= wanted:
        return []
    speed = abs(servo.units.velocity(own))
    detail = f"Velocity Limit {own} is {speed:.3g} rad/s, below the joint's limit of {joint.velocity_limit:g}"
    remedy = "raise it with the DYNAMIXEL Wizard, or lower limits.velocity: faster motions lag behind"
    return [Finding(Severity.WARNING, servo.label, detail, remedy)]


def _examine_secondary(servos: Sequence[JointServo], settings: Sequence[dict[str, int]]) -> list[Finding]:
    own = {servo.servo: servo.label for servo in servos}
    findings: list[Finding] = []
    for servo, values in zip(servos, settings, strict=True):
        for name in _SECONDARY:
            if (other := values.get(name)) in own:
                detail = f"its {name} {other} is the ID of {own[other]}: it would follow that one's goals"
                remedy = f"set {name} to 255 with the DYNAMIXEL Wizard"
                findings.append(Finding(Severity.FAILURE, servo.label, detail, remedy))
    return findings


def _examine_servo(servo: JointServo, settings: dict[str, int]) -> list[Finding]:
    unit = f"{abs(servo.units.milliampere):g} mA a unit ({servo.units.source})"
    findings = [Finding(Severity.GOOD, servo.label, f"answers, firmware {servo.firmware}, {unit}")]

    def find(severity: Severity, detail: str, remedy: str) -> None:
        findings.append(Finding(severity, servo.label, detail, remedy))

    if servo.model.family.torque_on_by_goal and servo.firmware < _LEAST_FIRMWARE:
        find(Severity.WARNING, f"firmware {servo.firmware} is old", "update it with the DYNAMIXEL Wizard")
    if settings["Return Delay Time"]:
        delay = f"Return Delay Time {settings['Return Delay Time'] * 2} µs"
        find(Severity.WARNING, delay, "none: the driver sets it to 0, and puts it back as it lets go")
    if settings["Drive Mode"] != drive_mode(servo, settings["Drive Mode"]):
        mode = f"Drive Mode {settings['Drive Mode']}: profiles by time, or torque that a goal switches on"
        find(Severity.WARNING, mode, "none: the driver clears these bits, and puts them back as it lets go")
    wanted = operating_mode(servo, ControlMode.POSITION)
    if settings["Operating Mode"] != wanted:
        change = f"Operating Mode {settings['Operating Mode']}: a run sets {wanted} in EEPROM"
        findings.append(Finding(Severity.GOOD, servo.label, f"{change}, and puts it back when it lets go of the arm"))
    if settings["Status Return Level"] != ANSWERS_ALL:
        level = f"Status Return Level {settings['Status Return Level']}: it does not answer every instruction"
        find(Severity.WARNING, level, "none: the driver sets it to 2 when it connects")
    if not settings["Current Limit"]:
        find(Severity.FAILURE, "Current Limit is 0: it cannot exert any torque", "raise it with the DYNAMIXEL Wizard")
    if settings["Torque Enable"]:
        remedy = "none where it holds the arm; else support the arm and switch torque off"
        find(Severity.WARNING, "is under torque", remedy)
    if not 0 <= settings["Bus Watchdog"] <= WATCHDOG_MOST:
        fault = watchdog_fault(servo.number)
        find(Severity.FAILURE, fault.detail, fault.remedy)
    for fault in hardware_faults(servo.model, settings[servo.model.error_item.name], servo.number):
        find(Severity.FAILURE, fault.detail, fault.remedy)
    if servo.units.torque_per_milliampere is None:
        remedy = "state joints[].torque_constant, or take results in mA"
        find(Severity.WARNING, "no torque constant: what is found is in units of current", remedy)
    return findings


# rates that servos can be set to, the factory's first [bit/s]
USUAL_BAUDS = (57_600, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 115_200, 4_500_000, 9_600)


def _list_servos(bus: ServoBus) -> list[tuple[int, str, str]]:
    return [(servo, describe_model(number), str(firmware)) for servo, (number, firmware) in bus.ping_all().items()]


examine = partial(examine_bus, read_configuration, ServoBus, _examine_servos)
scan_bus = partial(scan_bauds, USUAL_BAUDS, ServoBus, _list_servos)
