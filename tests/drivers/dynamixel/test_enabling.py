"""Servos are taken under power where they are, also while they move."""

from collections.abc import Mapping
from typing import cast

import numpy as np
import pytest

from tauscope_drivers.backend import ControlMode, DriveLimits
from tauscope_drivers.dynamixel.bus import ServoBus
from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import Block, Item
from tauscope_drivers.dynamixel.enabling import enable_servos
from tauscope_drivers.dynamixel.group import ServoGroup
from tauscope_drivers.dynamixel.health import Health
from tauscope_drivers.dynamixel.servo import make_servo
from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.errors import DriverError, DriverErrorKind

JOINTS = range(1, 7)
BEGIN = 2048
SETTINGS = {
    "Return Delay Time": 0,
    "Drive Mode": 0,
    "Operating Mode": 3,
    "PWM Limit": 885,
    "Current Limit": 1193,
    "Max Position Limit": 4095,
    "Min Position Limit": 0,
    "Status Return Level": 2,
}


class FallingArm:
    """A bus on whose servos each exchange of packets takes long enough for every joint to fall by one count."""

    def __init__(self, refuses: int = 0) -> None:
        self.place = BEGIN
        self.goals: dict[int, int] = {}
        self.carried_back: dict[int, int] = {}
        self._refuses = refuses

    def read_block(self, _servo: int, block: Block) -> Mapping[str, int]:
        self.place += 1
        return {item.name: self.place for item in block.items}

    def write(self, servo: int, item: Item, value: int) -> None:
        self.place += 1
        if item.name == "Goal Position":
            self.goals[servo] = value
        if item.name == "Torque Enable" and value and servo == self._refuses:
            raise DriverError(DriverErrorKind.REFUSED, "no")
        if item.name == "Torque Enable":
            self.carried_back.pop(servo, None)
            if value:
                self.carried_back[servo] = self.place - self.goals[servo]


def session(arm: FallingArm) -> Session:
    bus = cast(ServoBus, arm)
    servos = tuple(make_servo(joint, ServoConfiguration(f"joint{joint}", joint), (1020, 52)) for joint in JOINTS)
    return Session(bus, servos, [dict(SETTINGS) for _ in JOINTS], ServoGroup(bus, servos), Health(servos))


def limits() -> DriveLimits:
    return DriveLimits(*(np.full(len(JOINTS), value) for value in (-3.0, 3.0, 3.0, np.inf)))


def test_every_servo_of_a_falling_arm_catches_its_joint_where_it_is() -> None:
    arm = FallingArm()
    _, held = enable_servos(session(arm), ControlMode.POSITION, limits(), 0.1)
    assert arm.place - BEGIN > 50, "the whole takes long"
    assert list(arm.carried_back) == list(JOINTS)
    assert max(arm.carried_back.values()) <= 3
    assert held == list(arm.goals.values())


def test_servos_that_were_taken_are_let_go_where_a_later_one_fails() -> None:
    arm = FallingArm(refuses=4)
    with pytest.raises(DriverError, match="joint4"):
        enable_servos(session(arm), ControlMode.POSITION, limits(), 0.1)
    assert not arm.carried_back, "no servo has torque"
