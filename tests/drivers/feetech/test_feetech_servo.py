"""Counts, speeds and torque limits of a servo at its joint."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech.configuration import ServoConfiguration, read_configuration
from tauscope_drivers.feetech.servo import JointServo

PLACES = st.floats(-3.0, 3.0)


def servo(**configuration) -> JointServo:
    return JointServo(1, ServoConfiguration("joint1", 1, **configuration))


@given(PLACES, st.sampled_from([1, -1]), st.sampled_from([1.0, 2.5]), st.integers(0, 4095))
def test_a_place_is_the_nearest_count(place: float, direction: int, reduction: float, zero: int) -> None:
    one = servo(direction=direction, reduction=reduction, zero_count=zero)
    assert one.position(one.counts(place)) == pytest.approx(place, abs=0.51 * 2.0 * math.pi / 4096 / reduction)


@given(st.floats(-3.0, 0.0), st.floats(0.01, 3.0), st.sampled_from([1, -1]))
def test_goals_within_a_range_stay_within_it_and_within_one_turn(low: float, high: float, direction: int) -> None:
    one = servo(direction=direction)
    lowest, highest = one.counts_within(low, high)
    assert 0 <= lowest <= highest <= 4095
    for count in (lowest, highest):
        assert low - 1e-6 <= one.position(count) <= high + 1e-6


def test_no_range_is_the_whole_turn() -> None:
    assert servo().counts_within(-math.inf, math.inf) == (0, 4095)


def test_speed_limit_becomes_counts_a_second() -> None:
    assert servo().goal_speed(2.0) == 1303
    assert JointServo(1, ServoConfiguration("joint1", 1), 50).goal_speed(2.0) == 26
    assert servo().goal_speed(1e-6) == 1, "0 may mean no limit"
    assert servo().goal_speed(math.inf) == 32_766
    assert servo(direction=-1).velocity(100) == pytest.approx(-100 * 2.0 * math.pi / 4096)


def test_torque_limit_is_the_data_sheets_at_the_present_voltage_or_the_robot_files() -> None:
    assert servo().torque_limit(0.955, 74) == 500
    assert servo().torque_limit(0.955, 120) == 308
    assert servo(reduction=2.0).torque_limit(0.955, 74) == 250
    assert servo(torque_per_permille=-0.01).torque_limit(0.5, 74) == 50
    assert servo().torque_limit(math.inf, 74) == servo().torque_limit(99.0, 74) == 1000
    assert servo().torque_limit(1e-4, 74) == 0


@pytest.mark.parametrize(
    ("drive", "constant", "words"),
    [
        ({}, None, "drive.servo_id = None"),
        ({"servo_id": 254}, None, "from 0 to 253"),
        ({"servo_id": 1}, None, "drive.port is missing"),
        ({"servo_id": 1, "port": "/dev/x", "id": 1}, None, "drive.id is not known"),
        ({"servo_id": 1, "port": "/dev/x", "direction": 0}, None, "give 1 or -1"),
        ({"servo_id": 1, "port": "/dev/x", "zero_count": 4096}, None, "from 0 to 4095"),
        ({"servo_id": 1, "port": "/dev/x", "baud": 3_000_000}, None, "drive.baud"),
        ({"servo_id": 1, "port": "/dev/x"}, 0.0, "torque_constant = 0.0"),
    ],
)
def test_a_block_that_is_not_usable_is_refused_by_name(drive: dict, constant: float | None, words: str) -> None:
    with pytest.raises(DriverError, match="joint a") as caught:
        read_configuration([DriveJoint("a", drive, torque_per_unit=constant)])
    assert words in str(caught.value)


def test_an_id_that_is_there_twice_is_refused() -> None:
    joints = [DriveJoint(name, {"servo_id": 1, "port": "/dev/x"}) for name in "ab"]
    with pytest.raises(DriverError, match="is there twice"):
        read_configuration(joints)
