"""Counts to radians, units of velocity and current, with direction, reduction and zero."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import find_model
from tauscope_drivers.dynamixel.servo import ServoUnits

XM430 = find_model(1020)


def servo_units(**configuration: Any) -> ServoUnits:
    return ServoUnits.of(XM430, ServoConfiguration("joint1", 1, **configuration))


units = st.builds(
    lambda direction, reduction, zero: servo_units(direction=direction, reduction=reduction, zero_count=zero),
    st.sampled_from([-1, 1]),
    st.floats(0.1, 100.0),
    st.integers(-5000, 5000),
)


def test_xm430_as_in_the_manual() -> None:
    servo = servo_units()
    assert servo.position(2048) == 0.0
    assert servo.position(3072) == pytest.approx(math.pi / 2)
    assert servo.velocity(1) == pytest.approx(0.229 * 2.0 * math.pi / 60.0, rel=1e-3)
    assert servo.current(100) == pytest.approx(269.0)


def test_direction_turns_everything_round() -> None:
    servo = servo_units(direction=-1)
    assert servo.position(3072) == pytest.approx(-math.pi / 2)
    assert servo.velocity(10) < 0.0
    assert servo.current(10) == pytest.approx(-26.9)
    assert servo.counts(0.5) < 2048


def test_reduction_slows_the_joint() -> None:
    servo = servo_units(reduction=3.0)
    assert servo.position(3072) == pytest.approx(math.pi / 6)
    assert servo.velocity(3) == pytest.approx(servo_units().velocity(1))


@given(units, st.integers(-100_000, 100_000))
def test_counts_survive_the_way_there_and_back(servo: ServoUnits, counts: int) -> None:
    assert servo.counts(servo.position(counts)) == counts


@given(units, st.floats(-3.0, 0.0), st.floats(0.0, 3.0))
def test_range_in_counts_is_within_the_limits(servo: ServoUnits, low: float, high: float) -> None:
    lowest, highest = servo.counts_within(low, high)
    inside = [servo.position(lowest), servo.position(highest)]
    outside = [servo.position(lowest - 1), servo.position(highest + 1)]
    assert all(low - 1e-9 <= position <= high + 1e-9 for position in inside if lowest <= highest)
    assert all(position <= low + 1e-9 or position >= high - 1e-9 for position in outside)


def test_no_limit_is_the_servos_own_reach() -> None:
    assert servo_units().counts_within(-math.inf, math.inf) == (-1_048_575, 1_048_575)


def test_current_cap_never_exceeds_the_torque_limit() -> None:
    servo = servo_units(torque_per_milliampere=-0.002)
    cap = servo.current_cap(1.0)
    assert cap == math.floor(1.0 / 0.002 / 2.69)
    assert abs(servo.current(cap) * 0.002) <= 1.0
    assert servo.current_cap(math.inf) == 0x7FFF


def test_torque_becomes_current_with_its_sign() -> None:
    assert servo_units(torque_per_milliampere=0.01).current_units(2.69) == 100
    assert servo_units(direction=-1, torque_per_milliampere=0.01).current_units(2.69) == -100


def test_torque_without_a_constant_is_no_current() -> None:
    with pytest.raises(ValueError, match="torque constant"):
        servo_units().current_units(1.0)


def test_velocity_cap() -> None:
    servo = servo_units()
    assert servo.velocity_cap(math.inf) == 0
    assert servo.velocity_cap(1.0) == 41
    assert servo.velocity_cap(1e-6) == 1


def test_figure_of_the_robot_file_comes_first() -> None:
    servo = servo_units(milliampere_per_unit=2.7)
    assert servo.current(10) == pytest.approx(27.0)
    assert servo.source == "robot file"
    assert "Dynamixel2Arduino" in servo_units().source
