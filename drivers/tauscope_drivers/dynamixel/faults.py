"""What servos report, in words with a remedy."""

from tauscope_drivers.dynamixel.control_table import ServoModel
from tauscope_drivers.errors import Fault

_POWER_CYCLE = "support the arm, switch the servo's power off and on, then acknowledge"

_BITS: tuple[tuple[int, str, str, str], ...] = (
    (0x01, "voltage", "input voltage outside its range", f"check the supply; {_POWER_CYCLE}"),
    (0x02, "encoder", "motor hall sensor fault", f"{_POWER_CYCLE}; replace the servo where it returns"),
    (0x04, "over-temperature", "too hot", f"let it cool down; {_POWER_CYCLE}"),
    (0x08, "encoder", "encoder fault", f"{_POWER_CYCLE}; replace the servo where it returns"),
    (0x10, "electrical", "electrical shock or too little power", f"check wiring and supply; {_POWER_CYCLE}"),
    (0x20, "overload", "overload for too long", f"lower the load or the current limit; {_POWER_CYCLE}"),
)

_CLEAR = "then acknowledge"
_CODES: dict[int, tuple[str, str, str]] = {
    1: ("voltage", "input voltage too high", f"check the supply, {_CLEAR}"),
    2: ("voltage", "input voltage too low", f"check the supply, {_CLEAR}"),
    3: ("over-temperature", "inverter too hot", f"let it cool down, {_CLEAR}"),
    4: ("over-temperature", "motor too hot", f"let it cool down, {_CLEAR}"),
    5: ("overload", "overload for too long", f"lower the load or the current limit, {_CLEAR}"),
    7: ("drive-hardware", "inverter fault", "have the servo repaired"),
    9: ("battery", "multi-turn battery low", "replace the battery"),
    10: ("battery", "multi-turn battery empty", "replace the battery"),
    11: ("encoder", "multi-turn position lost", "reset the multi-turn position with the wizard"),
    12: ("encoder", "multi-turn sensor fault", "have the servo repaired"),
    13: ("encoder", "encoder fault", "have the servo repaired"),
    14: ("encoder", "hall sensor fault", "have the servo repaired"),
    15: ("drive-hardware", "no calibration data", "have the servo repaired"),
    17: ("following-error", "following error too large", f"move slower, {_CLEAR}"),
    19: ("over-speed", "faster than its Velocity Limit allows", f"move slower, {_CLEAR}"),
    20: ("position-limit", "beyond its Position Limit", f"move the joint back by hand, {_CLEAR}"),
}
_WATCHDOG_CODE = 18


def hardware_faults(model: ServoModel, register: int, joint: int) -> tuple[Fault, ...]:
    """Faults that a servo's error register states; empty for 0. `joint`: number of the joint, from 1."""
    if not register:
        return ()
    name = model.error_item.name
    if model.family.error_is_code:
        if register == _WATCHDOG_CODE:
            return (watchdog_fault(joint),)
        code, meaning, remedy = _CODES.get(register, ("drive", "fault", "see the servo's manual for the code"))
        return (Fault(code, joint, f"{meaning}, {name} {register}", remedy),)
    found = tuple(
        Fault(code, joint, f"{meaning}, {name} 0x{register:02X}", remedy)
        for bit, code, meaning, remedy in _BITS
        if register & bit
    )
    return found or (Fault("drive", joint, f"{name} 0x{register:02X}", "see the servo's manual for the bits"),)


def watchdog_fault(joint: int | None) -> Fault:
    """The Bus Watchdog of a servo has fired, or those of all. `joint`: number of the joint, from 1; None for all."""
    who = "the servos" if joint is None else "the servo"
    detail = f"{who} heard no instruction in time and stopped"
    return Fault("watchdog", joint, detail, "make sure the host runs, then acknowledge")


def alert_fault(joint: int) -> Fault:
    """The servo sets the alert bit, and which error it is was not read yet. `joint`: number of the joint, from 1."""
    return Fault("hardware-error", joint, "the servo sets its alert bit", "read Hardware Error Status with the wizard")


def torque_lost_fault(joint: int) -> Fault:
    """The servo is without torque though it was given some: it restarted, or was switched off by somebody else.

    `joint`: number of the joint, from 1.
    """
    return Fault(
        "restarted",
        joint,
        "the servo has let go of the joint; it lost power or was restarted",
        "check supply and cable, then acknowledge and enable again",
    )


def silent_servo_fault(detail: str) -> Fault:
    """A servo could not be stopped, for it did not answer: its own watchdog has stopped it."""
    return Fault("silent", None, detail, "look at the arm; check the servo's power and cable, then stop again")


def lost_bus_fault(detail: str) -> Fault:
    """The bus is gone: what the arm does now is what the servos' watchdogs make it do."""
    return Fault("lost-bus", None, detail, "check the adapter, its cable and its power, then connect again")
