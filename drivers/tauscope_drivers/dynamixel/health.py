"""What is known of each servo's health: its faults and whether it holds its joint.

Group instructions hide it. The alert bit comes with every answer; registers are read one servo a cycle, in turn.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from tauscope_drivers.dynamixel.faults import alert_fault, hardware_faults, torque_lost_fault, watchdog_fault
from tauscope_drivers.dynamixel.models import WATCHDOG_MOST
from tauscope_drivers.dynamixel.servo import JointServo
from tauscope_drivers.errors import Fault


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
        self._alerts = np.zeros(count, dtype=np.bool_)
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

    def take_alert(self, joint: int, alert: bool) -> None:
        """Take the alert bit of an answer. `joint`: index of the joint, from 0."""
        self._alerts[joint] = alert

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
        self._alerts[:] = False

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
            if self._alerts[index] and not hardware:
                found.append(alert_fault(servo.number))
            if self._lost[index] and not hardware:
                found.append(torque_lost_fault(servo.number))
        return tuple(found)
