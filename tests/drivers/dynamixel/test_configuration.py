"""``drive`` blocks: defaults, and refusals that name joint and key."""

import math
from typing import Any

import pytest

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.configuration import read_configuration
from tauscope_drivers.errors import DriverError, DriverErrorKind


def joints(*drives: dict[str, Any]) -> list[DriveJoint]:
    return [DriveJoint(f"joint{number}", drive) for number, drive in enumerate(drives, 1)]


def test_defaults() -> None:
    configuration = read_configuration(joints({"id": 1, "port": "/dev/ttyUSB0"}, {"id": 2}))
    assert configuration.port == "/dev/ttyUSB0"
    assert configuration.baud == 1_000_000
    assert [servo.servo for servo in configuration.servos] == [1, 2]
    assert configuration.servos[0].direction == 1
    assert configuration.servos[0].reduction == 1.0
    assert configuration.servos[0].zero_count is None


def test_all_keys() -> None:
    drive = {
        "id": 3,
        "port": "/dev/ttyUSB1",
        "baud": 4_500_000,
        "model": "XM540-W270",
        "direction": -1,
        "reduction": 2.5,
        "zero_count": 1000,
        "milliampere_per_unit": 2.7,
        "current_limit_ma": 900,
        "stop_policy": "hold",
    }
    configuration = read_configuration(joints(drive))
    servo = configuration.servos[0]
    assert (servo.servo, servo.model, servo.direction, servo.reduction) == (3, "XM540-W270", -1, 2.5)
    assert (servo.zero_count, servo.milliampere_per_unit, servo.current_limit_ma) == (1000, 2.7, 900.0)
    assert configuration.baud == 4_500_000


PORT = {"port": "/dev/ttyUSB0"}


@pytest.mark.parametrize(
    ("drives", "message"),
    [
        ([{**PORT, "id": 1, "speed": 3}], "joint joint1: drive.speed is not known"),
        ([{**PORT}], "joint joint1: drive.id = None"),
        ([{**PORT, "id": True}], "joint joint1: drive.id = True"),
        ([{**PORT, "id": 253}], "joint joint1: drive.id = 253"),
        ([{**PORT, "id": "one"}], "joint joint1: drive.id = 'one'"),
        ([{**PORT, "id": 1}, {"id": 1}], "drive.id = 1 is there twice"),
        ([{"id": 1}], "joint joint1: drive.port is missing"),
        ([{"id": 1, "port": 7}], "joint joint1: drive.port is missing"),
        (
            [{**PORT, "id": 1}, {"id": 2, "port": "/dev/ttyUSB9"}],
            "joint joint2: drive.port differs from that of joint1",
        ),
        ([{**PORT, "id": 1}, {"id": 2, "baud": 57600}], "joint joint2: drive.baud differs"),
        ([{**PORT, "id": 1, "baud": 300}], "drive.baud = 300"),
        ([{**PORT, "id": 1, "direction": 0}], "drive.direction = 0"),
        ([{**PORT, "id": 1, "direction": 2}], "drive.direction = 2"),
        ([{**PORT, "id": 1, "reduction": -3}], "drive.reduction = -3"),
        ([{**PORT, "id": 1, "reduction": math.nan}], "drive.reduction = nan"),
        ([{**PORT, "id": 1, "current_limit_ma": 0}], "drive.current_limit_ma = 0"),
        ([{**PORT, "id": 1, "zero_count": 0.5}], "drive.zero_count = 0.5"),
        ([{**PORT, "id": 1, "model": "XZ1"}], "model 'XZ1' is not known"),
        ([{**PORT, "id": 1, "model": 430}], "drive.model = 430"),
    ],
)
def test_refusals_name_joint_and_key(drives: list[dict[str, Any]], message: str) -> None:
    with pytest.raises(DriverError) as caught:
        read_configuration(joints(*drives))
    assert message in str(caught.value)
    assert caught.value.kind is DriverErrorKind.REFUSED
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("constant", [0.0, math.nan, math.inf])
def test_impossible_torque_constant_is_refused(constant: float) -> None:
    with pytest.raises(DriverError, match="torque_constant"):
        read_configuration([DriveJoint("j", {**PORT, "id": 1}, torque_per_unit=constant)])
