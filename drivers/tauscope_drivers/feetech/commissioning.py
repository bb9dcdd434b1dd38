"""Everything that a run needs, looked at before: it refuses a run and fills doctor's findings; writes nothing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tauscope_drivers.backend import DriveLimits
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech import registers
from tauscope_drivers.feetech.servo import JointServo
from tauscope_drivers.feetech.session import Session, alarm_faults
from tauscope_drivers.inspection import Finding, Severity, failure
from tauscope_drivers.limits import require_sensible
from tauscope_drivers.serial_servos.bus import RETURN_DELAY_UNIT_S

_TOOL = "with Feetech's FD: Tauscope writes nothing to EEPROM"


@dataclass(frozen=True)
class ServoTask:
    """What a servo shall do once it has torque. `low`, `high`: range of its goals [counts]."""

    low: int
    high: int
    speed: int  # Goal Speed [units]
    torque: int  # Torque Limit [‰ of full duty]

    def bound(self, goal: int) -> int:
        """A goal within the range."""
        return min(max(goal, self.low), self.high)


@dataclass(frozen=True, eq=False)
class Reading:
    """One servo as it was read: registers by name, and its alarms."""

    settings: Mapping[str, int]
    feedback: Mapping[str, int]
    alarms: int = 0


def read_servo(session: Session, joint: int) -> Reading:
    """Read a servo. `joint`: index of the joint, from 0."""
    feedback = session.read_feedback(joint)
    return Reading(session.settings[joint], feedback, session.health.alarms[joint])


def plan_task(servo: JointServo, reading: Reading, limits: DriveLimits, joint: int) -> ServoTask:
    """What a servo shall do within an arm's limits. `joint`: index of the joint within the limits, from 0."""
    settings = reading.settings
    low, high = servo.counts_within(float(limits.position_low[joint]), float(limits.position_high[joint]))
    torque = servo.torque_limit(float(limits.torque[joint]), reading.feedback["Present Voltage"])
    return ServoTask(
        max(low, settings["Min Position Limit"]),
        min(high, settings["Max Position Limit"]),
        servo.goal_speed(float(limits.velocity[joint])),
        min(torque, settings["Max Torque Limit"]),
    )


def find_flaws(servo: JointServo, reading: Reading, limits: DriveLimits, joint: int) -> list[Finding]:
    """Everything that keeps a servo from a run. `joint`: index of the joint within the limits, from 0."""
    flaws: list[Finding] = []

    def find(detail: str, remedy: str) -> None:
        flaws.append(Finding(Severity.FAILURE, servo.label, detail, remedy))

    settings = reading.settings
    if (mode := settings["Operating Mode"]) != registers.POSITION_MODE:
        name, wanted = registers.MODE_NAMES.get(mode, "unknown"), registers.POSITION_MODE
        find(f"Operating Mode is {mode} ({name}), a run needs {wanted} (position)", f"set it to {wanted} {_TOOL}")
    if settings["Phase"] & registers.FULL_ANGLE or settings["Min Position Limit"] >= settings["Max Position Limit"]:
        find(
            "it counts whole turns (Position Limits 0 and 0, or bit 4 of Phase), and forgets them without power",
            f"set Min and Max Position Limit within 0 to {registers.COUNTS_PER_TURN - 1}, and clear that bit, {_TOOL}",
        )
    if not settings["P Coefficient"]:
        find("P Coefficient is 0: it cannot hold anything", f"set it, 32 as delivered, {_TOOL}")
    if not settings["Max Torque Limit"]:
        find("Max Torque Limit is 0: it cannot exert any torque", f"raise it {_TOOL}")
    volts, unit = reading.feedback["Present Voltage"], registers.VOLT
    low, high = settings["Min Voltage Limit"], settings["Max Voltage Limit"]
    if not low <= volts <= high:
        detail = f"supply of {volts * unit:.1f} V, its Voltage Limits are {low * unit:.1f} to {high * unit:.1f} V"
        find(detail, "check the supply, its plug and the cables")
    for fault in alarm_faults(reading.alarms, servo.number):
        find(fault.detail, fault.remedy)
    if flaws:
        return flaws
    task, present = plan_task(servo, reading, limits, joint), reading.feedback["Present Position"]
    low, high = settings["Min Position Limit"], settings["Max Position Limit"]
    if not task.torque:
        remedy = "raise limits.torque, or state joints[].torque_constant as Nm for 1 ‰ of load"
        find("the torque limit is below 1 ‰ of its duty", remedy)
    elif task.low >= task.high:
        remedy = "correct limits.position, drive.zero_count or the servo's own limits"
        find("its own Position Limits leave nothing of the joint's range", remedy)
    elif not low <= present <= high:
        detail = f"stands at count {present}, its own Position Limits are {low} to {high}"
        find(detail, f"move it back by hand, or widen them {_TOOL}")
    return flaws


def rehearse(servo: JointServo, reading: Reading, limits: DriveLimits) -> list[Finding]:
    """Everything by which a run would be refused because of one joint; the limits are those of this joint alone."""
    try:
        require_sensible(limits, np.array([servo.position(reading.feedback["Present Position"])]), [servo.label])
    except DriverError as error:
        return [failure(servo.label, str(error))]
    return find_flaws(servo, reading, limits, 0)


def find_doubts(servo: JointServo, reading: Reading, limits: DriveLimits, targets: Mapping[str, int]) -> list[Finding]:
    """What a run can do with, said by doctor. `limits`: of this joint alone; `targets`: the registers of `TARGETS`."""
    settings = reading.settings
    gains = ", ".join(f"{name} {settings[f'{name} Coefficient']}" for name in "PDI")
    volts = reading.feedback["Present Voltage"] * registers.VOLT
    dead = max(settings["CW Dead Zone"], settings["CCW Dead Zone"])
    firmware = registers.describe_firmware(settings)
    detail = f"STS3215, firmware {firmware}, {gains}, dead zone {dead} counts, {volts:.1f} V"
    found = [Finding(Severity.GOOD, servo.label, detail)]

    def find(detail: str, remedy: str) -> None:
        found.append(Finding(Severity.WARNING, servo.label, detail, remedy))

    if delay := settings["Return Delay Time"]:
        delay_us = delay * RETURN_DELAY_UNIT_S * 1e6
        find(f"Return Delay Time {delay_us:.0f} µs lowers the rate", f"set it to 0 {_TOOL}")
    if not settings["Response Status Level"]:
        find("Response Status Level 0: it answers reads alone", f"none needed; 1 enables sooner, set {_TOOL}")
    if (unloading := settings["Unloading Condition"]) & registers.PROTECTIONS != registers.PROTECTIONS:
        detail = f"Unloading Condition {unloading}: it does not protect itself from both heat and overload"
        find(detail, f"set it to {registers.PROTECTIVE}, as delivered, {_TOOL}")
    if not targets["Lock"]:
        find("Lock is 0: whatever a program writes to EEPROM stays", "set Lock to 1 once it is set up")
    if targets["Torque Enable"]:
        find("is under torque", "none where it holds the arm; else support the arm and run tauscope release")
    if servo.configuration.torque_per_permille is None:
        find("no torque constant: results are in ‰ of duty", "state joints[].torque_constant as Nm for 1 ‰ of load")
    low, high = float(limits.position_low[0]), float(limits.position_high[0])
    if math.isfinite(low) and math.isfinite(high):
        wanted = sorted((servo.counts(low), servo.counts(high)))
        if wanted[0] < settings["Min Position Limit"] or wanted[1] > settings["Max Position Limit"]:
            detail = f"the joint's range is {wanted[0]} to {wanted[1]} counts, the servo's own is narrower: "
            own = f"{settings['Min Position Limit']} to {settings['Max Position Limit']}"
            find(detail + own, "narrow limits.position: goals beyond its own range are cut off")
    return found
