"""Which registers are written before torque, in which order."""

import math

import pytest

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.preparation import (
    RegisterWrite,
    ServoTask,
    commissioning_writes,
    current_cap,
    position_counts,
    preparing_writes,
    taking_writes,
    watchdog_steps,
)
from tauscope_drivers.dynamixel.servo import JointServo, make_servo
from tauscope_drivers.errors import DriverError

SETTINGS = {
    "Return Delay Time": 250,
    "Drive Mode": 0,
    "Operating Mode": 3,
    "PWM Limit": 885,
    "Current Limit": 1193,
    "Max Position Limit": 4095,
    "Min Position Limit": 0,
    "Status Return Level": 2,
}
TASK = ServoTask(ControlMode.POSITION, current_cap=300, velocity_cap=80, present=2100, watchdog_steps=5)


def servo(number: int = 1020, **configuration: float) -> JointServo:
    return make_servo(1, ServoConfiguration("elbow", 7, **configuration), (number, 52))  # pyright: ignore[reportArgumentType]


def names(writes: list[RegisterWrite]) -> list[str]:
    return [write.item.name for write in writes]


def values(writes: list[RegisterWrite]) -> dict[str, int]:
    return {write.item.name: write.value for write in writes}


def test_torque_comes_last_and_after_goal_and_watchdog() -> None:
    assert names(taking_writes(servo(), TASK, holds=False)) == ["Goal Position", "Bus Watchdog", "Torque Enable"]
    assert values(taking_writes(servo(), TASK, holds=False)) == {
        "Goal Position": 2100,
        "Bus Watchdog": 5,
        "Torque Enable": 1,
    }


def test_limits_are_written_before_a_servo_is_taken_and_the_mode_before_them() -> None:
    writes = preparing_writes(servo(), SETTINGS, TASK, holds=False)
    # a change of mode resets what depends on it
    assert names(writes)[0] == "Operating Mode"
    assert values(writes) == {
        "Operating Mode": 5,
        "Goal PWM": 885,
        "Profile Acceleration": 0,
        "Profile Velocity": 80,
        "Goal Current": 300,
    }


def test_current_mode_starts_without_current() -> None:
    task = ServoTask(ControlMode.TORQUE, 300, 80, 2100, 5)
    written = values(preparing_writes(servo(), SETTINGS, task, holds=False))
    assert written["Operating Mode"] == 0
    assert written["Goal Current"] == 0
    assert "Goal Position" not in written
    assert names(taking_writes(servo(), task, holds=False)) == ["Bus Watchdog", "Torque Enable"]


def test_servo_that_holds_is_taken_over_without_letting_go() -> None:
    order = names(preparing_writes(servo(), SETTINGS | {"Operating Mode": 5}, TASK, holds=True))
    assert order[0] == "Goal Position"
    assert "Operating Mode" not in order
    assert names(taking_writes(servo(), TASK, holds=True)) == ["Bus Watchdog"]


@pytest.mark.parametrize("number", [2020, 4030])
def test_p_and_y_track_positions_in_mode_3_with_goal_current_as_cap(number: int) -> None:
    written = values(preparing_writes(servo(number), SETTINGS | {"Operating Mode": 0}, TASK, holds=False))
    assert written["Operating Mode"] == 3
    assert written["Goal Current"] == 300


def test_commissioning_writes_only_what_differs() -> None:
    assert values(commissioning_writes(servo(), SETTINGS, holds=False)) == {"Return Delay Time": 0}
    assert commissioning_writes(servo(), SETTINGS | {"Return Delay Time": 0}, holds=False) == []


def test_torque_that_a_goal_switches_on_is_switched_off_before_any_goal() -> None:
    written = values(commissioning_writes(servo(), SETTINGS | {"Drive Mode": 0x0D}, holds=False))
    assert written["Drive Mode"] == 0x01  # the direction stays


def test_no_eeprom_is_written_under_torque() -> None:
    assert commissioning_writes(servo(), SETTINGS | {"Drive Mode": 0x0C}, holds=True) == []


@pytest.mark.parametrize(("seconds", "steps"), [(0.02, 1), (0.06, 3), (0.1, 5), (0.119, 5), (2.54, 127)])
def test_watchdog_is_never_longer_than_asked(seconds: float, steps: int) -> None:
    assert watchdog_steps(seconds) == steps


@pytest.mark.parametrize("seconds", [0.0, 0.019, -1.0, 2.6, math.nan, math.inf])
def test_impossible_watchdog_is_refused(seconds: float) -> None:
    with pytest.raises(DriverError, match="watchdog"):
        watchdog_steps(seconds)


def test_cap_is_the_least_of_all_limits() -> None:
    assert current_cap(servo(), SETTINGS, math.inf) == 1193
    assert current_cap(servo(current_limit_ma=269.0), SETTINGS, math.inf) == 100
    assert current_cap(servo(torque_per_milliampere=0.01), SETTINGS, 2.69) == 100
    assert current_cap(servo(torque_per_milliampere=0.01, current_limit_ma=26.9), SETTINGS, 2.69) == 10


def test_torque_limit_without_a_constant_is_refused_unless_current_is_limited() -> None:
    with pytest.raises(DriverError, match=r"elbow.*torque_constant"):
        current_cap(servo(), SETTINGS, 3.0)
    assert current_cap(servo(current_limit_ma=269.0), SETTINGS, 3.0) == 100


def test_limits_that_leave_no_current_are_refused() -> None:
    with pytest.raises(DriverError, match="no current at all"):
        current_cap(servo(torque_per_milliampere=1.0), SETTINGS, 0.1)


def test_servos_own_limits_count_where_it_applies_them() -> None:
    limits = {"Max Position Limit": 1000, "Min Position Limit": -1000}
    assert position_counts(servo(2020), SETTINGS | limits, -3.0, 3.0, ControlMode.POSITION) == (-1000, 1000)
    low, high = position_counts(servo(1020), SETTINGS | limits, -3.0, 3.0, ControlMode.POSITION)
    assert (low, high) == (2048 - 1955, 2048 + 1955)
