"""What is known of each servo's health: alert bits come with every answer, registers of one servo a cycle, in turn."""

from collections.abc import Mapping, Sequence

import numpy as np

from tauscope_drivers.dynamixel.control_table import WATCHDOG_MOST, ServoModel
from tauscope_drivers.dynamixel.servo import JointServo
from tauscope_drivers.errors import HOST_REMEDY, Fault, decode_bits

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
    return decode_bits(_BITS, register, joint, name, "see the servo's manual for the bits")


def watchdog_fault(joint: int | None) -> Fault:
    """The Bus Watchdog of a servo has fired, or those of all. `joint`: number of the joint, from 1; None for all."""
    who = "the servos" if joint is None else "the servo"
    return Fault("watchdog", joint, f"{who} heard no instruction in time and stopped", HOST_REMEDY)


# which error it is was not read yet
_ALERT = "the servo sets its alert bit", "read Hardware Error Status with the wizard"
_TORQUE_LOST = (
    "the servo has let go of the joint; it lost power or was restarted",
    "check supply and cable, then acknowledge and enable again",
)


class Health:
    """Faults and torque of all servos, as last read."""

    def __init__(self, servos: Sequence[JointServo]) -> None:
        count = len(servos)
        self.has_torque = np.zeros(count, dtype=np.bool_)
        self.is_latched = np.zeros(count, dtype=np.bool_)
        self.temperature = np.full(count, np.nan)
        self.runaway: Fault | None = None
        self._servos = servos
        self._expected = np.zeros(count, dtype=np.bool_)
        self._registers = [0] * count
        self.alerts = np.zeros(count, dtype=np.bool_)  # alert bit of the last answer of each
        self._lost = np.zeros(count, dtype=np.bool_)

    def take(self, joint: int, values: Mapping[str, int]) -> None:
        """Take what was read of one servo. `joint`: index of the joint, from 0."""
        model = self._servos[joint].model
        if "Torque Enable" in values:
            self.has_torque[joint] = bool(values["Torque Enable"])
            self._lost[joint] |= bool(self._expected[joint] and not self.has_torque[joint])
        if "Bus Watchdog" in values:
            self.is_latched[joint] = not 0 <= values["Bus Watchdog"] <= WATCHDOG_MOST
            # A servo that restarts comes back without its watchdog, and without torque.
            self._lost[joint] |= bool(self._expected[joint] and values["Bus Watchdog"] == 0)
            self.has_torque[joint] &= not self._lost[joint]
        if model.error_item.name in values:
            self._registers[joint] = values[model.error_item.name]
        if model.temperature_item.name in values:
            self.temperature[joint] = float(values[model.temperature_item.name])

    def states_error(self, joint: int) -> bool:
        """Whether a servo's error register was read and stated an error. `joint`: index of the joint, from 0."""
        return bool(self._registers[joint])

    def expect_torque(self, expected: bool) -> None:
        """Say whether the servos shall have torque from now on; one that loses it meanwhile is at fault."""
        self._expected[:] = expected

    def forget(self) -> None:
        """Forget that servos lost their torque, set their alert bits or were caught: the operator knows."""
        self.runaway = None
        self._lost[:] = False
        self.alerts[:] = False

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What the servos report, joint by joint; a watchdog that has fired on all of them concerns the whole arm."""
        found: list[Fault] = [] if self.runaway is None else [self.runaway]
        found += [watchdog_fault(None)] if self.is_latched.all() else []
        for index, servo in enumerate(self._servos):
            hardware = hardware_faults(servo.model, self._registers[index], servo.number)
            found += [fault for fault in hardware if fault.code != "watchdog"]
            if self.is_latched[index] and not self.is_latched.all():
                found.append(watchdog_fault(servo.number))
            if self.alerts[index] and not hardware:
                found.append(Fault("hardware-error", servo.number, *_ALERT))
            if self._lost[index] and not hardware:
                found.append(Fault("restarted", servo.number, *_TORQUE_LOST))
        return tuple(found)
