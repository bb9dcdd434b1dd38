"""What servos report, in words with a remedy."""

from tauscope_drivers.errors import Fault

_CLEAR = "then acknowledge"

_BITS: tuple[tuple[int, str, str, str], ...] = (
    (0x01, "voltage", "supply voltage outside its limits", f"check the supply, {_CLEAR}"),
    (0x02, "encoder", "encoder fault", "switch the servo's power off and on; replace it where the fault returns"),
    (0x04, "over-temperature", "too hot", f"let it cool down, {_CLEAR}"),
    (0x08, "over-current", "too much current", f"look for an obstacle, let go of the arm, {_CLEAR}"),
    (0x20, "overload", "overload for too long", f"lower the load, let go of the arm, {_CLEAR}"),
)


def alarm_faults(alarms: int, joint: int) -> tuple[Fault, ...]:
    """Faults that a servo's alarms state; empty for 0.

    `alarms`: bits of the register Status, which every answer carries; `joint`: number of the joint, from 1.
    """
    found = tuple(
        Fault(code, joint, f"{meaning}, Status 0x{alarms:02X}", remedy)
        for bit, code, meaning, remedy in _BITS
        if alarms & bit
    )
    if found or not alarms:
        return found
    return (Fault("drive", joint, f"Status 0x{alarms:02X}", "see the servo's memory table for the bits"),)


def watchdog_fault() -> Fault:
    """The host was silent for longer than the watchdog's time."""
    detail = "no goal was sent in time; the servos hold their last one"
    return Fault("watchdog", None, detail, "make sure the host runs, then acknowledge")


def restarted_fault(joint: int) -> Fault:
    """A servo is without torque or limits that it was given: it restarted, or somebody else wrote to it.

    `joint`: number of the joint, from 1.
    """
    detail = "the servo has lost its torque or its limits; it lost power or was restarted"
    return Fault("restarted", joint, detail, "check supply and cable, then acknowledge and enable again")


def silent_servo_fault(detail: str) -> Fault:
    """A servo could not be stopped, for it did not answer: it was told to let go, which nobody has confirmed."""
    remedy = "look at the arm; check the servo's power and cable, then stop again"
    return Fault("silent", None, detail, remedy)


def lost_bus_fault(detail: str) -> Fault:
    """The bus is gone: the servos hold their last goals."""
    return Fault("lost-bus", None, detail, "check the adapter, its cable and its power, then connect again")
