"""Settings in EEPROM: put back when the arm is let go, by this process or by another one."""

from pathlib import Path

import numpy as np
import pytest

from drivers.wired_port import WiredPort
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.dynamixel.session import FOLDER, OriginalSettings
from tauscope_drivers.limits import stated_limits
from tauscope_sim.dynamixel_bus import ServoSpecification
from tauscope_sim.dynamixel_bus.servo import EmulatedServo

JOINTS = [DriveJoint("joint1", {"id": 1, "port": "wired"}, torque_per_unit=0.01)]
DELIVERED = {"Return Delay Time": 250, "Operating Mode": 3, "Drive Mode": 4}
CHANGED = {"Return Delay Time": 0, "Operating Mode": 5, "Drive Mode": 0}


@pytest.fixture
def servo(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> EmulatedServo:
    monkeypatch.setattr("tauscope_drivers.serial_servos.arm.SerialPort", WiredPort)
    monkeypatch.setenv(FOLDER, str(tmp_path))
    return WiredPort.wire([(ServoSpecification(1, registers={"Drive Mode": 4}), 0.2)])[0]


def settings(servo: EmulatedServo) -> dict[str, int]:
    return {name: servo.memory.get(name) for name in DELIVERED}


def held_arm(*, keeps_settings: bool = False) -> DynamixelArm:
    arm = DynamixelArm(JOINTS, keeps_settings=keeps_settings)
    arm.connect()
    arm.enable(ControlMode.POSITION, stated_limits(JOINTS), StopPolicy.HOLD, 1.0, 0.01)
    return arm


def let_go(*, keeps_settings: bool = False) -> None:
    arm = DynamixelArm(JOINTS, keeps_settings=keeps_settings)
    arm.connect()
    arm.stop(StopPolicy.TORQUE_OFF)
    arm.disconnect()


def test_they_stay_while_the_arm_holds_and_another_process_puts_them_back(servo: EmulatedServo) -> None:
    arm = held_arm()
    (told,) = arm.capabilities.remarks
    assert told.startswith("joint joint1: in EEPROM until the arm is let go: ")
    for words in (
        "Return Delay Time 0 in place of 250",
        "Operating Mode 5 in place of 3",
        "Drive Mode 0 in place of 4",
    ):
        assert words in told
    arm.stop(StopPolicy.HOLD)
    arm.disconnect()
    assert settings(servo) == CHANGED
    let_go()
    assert settings(servo) == DELIVERED
    assert not OriginalSettings("wired", 1).before


def test_a_stop_that_lets_go_puts_them_back(servo: EmulatedServo) -> None:
    arm = held_arm()
    arm.stop(StopPolicy.TORQUE_OFF)
    arm.disconnect()
    assert settings(servo) == DELIVERED


def test_they_are_kept_on_request(servo: EmulatedServo) -> None:
    arm = held_arm(keeps_settings=True)
    arm.stop(StopPolicy.TORQUE_OFF)
    arm.disconnect()
    assert settings(servo) == CHANGED


def test_another_servo_of_the_same_number_does_not_get_them(servo: EmulatedServo) -> None:
    arm = held_arm()
    arm.stop(StopPolicy.HOLD)
    arm.disconnect()
    (other,) = WiredPort.wire([(ServoSpecification(1, registers={"Operating Mode": 4}), 0.2)])
    let_go()
    assert other.memory.get("Operating Mode") == 4


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"before": 3, "after": 4}', '{"before": {"Drive Mode": "x"}}'])
def test_a_damaged_file_keeps_nothing(servo: EmulatedServo, content: str, tmp_path: Path) -> None:
    kept = OriginalSettings("wired", 1)
    kept.remember("Drive Mode", 4, 0)
    (path,) = tmp_path.rglob("*.json")
    path.write_text(content, encoding="utf-8")
    assert not OriginalSettings("wired", 1).before
    assert np.isfinite(held_arm().stop(StopPolicy.HOLD).position).all()


def test_a_service_keeps_them_in_the_folder_that_systemd_names(
    servo: EmulatedServo, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(FOLDER)
    monkeypatch.setenv("STATE_DIRECTORY", f"{tmp_path / 'service'}:/elsewhere")
    OriginalSettings("wired", 1).remember("Drive Mode", 4, 0)
    assert list((tmp_path / "service").rglob("*.json"))
