"""Field buses from a robot file: which one is meant, what of it reaches the driver, what is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arms import paper_arm
from emulated_data_sheet import GAIN, sections, write_file
from tauscope.errors import AcquisitionError
from tauscope.robot import Robot
from tauscope.runtime.drivers import (
    FrameRequest,
    PlannedFrame,
    find_bus,
    make_backend,
    select_bus,
    to_drive_joints,
    translate_driver_errors,
)
from tauscope.runtime.options import RunOptions, choose_rate_hz, choose_stop_policy
from tauscope_drivers import Capabilities, ControlMode, DriveLimits, StopPolicy


def servo_arm(**first: Any) -> Robot:
    robot = paper_arm()
    drives = [
        {"id": number, "model": "XM430-W350", **({"port": "/dev/none"} | first if number == 1 else {})}
        for number in (1, 2, 3)
    ]
    joints = (
        replace(robot.joints[0], torque_constant=0.002, sign=-1, drive=drives[0]),
        replace(robot.joints[1], torque_constant=0.002, drive=drives[1]),
        replace(robot.joints[2], drive=drives[2]),
    )
    return replace(robot, joints=joints)


def drive_arm(folder: Path, **second: Any) -> Robot:
    """The robot file is said to be in a folder."""
    robot = paper_arm()
    bus = {"interface": "nobody opens it", "channel": "none"}
    drives = [{"node_id": number, "counts_per_turn": 4096, "rated_torque_nm": 0.5} for number in (1, 2, 3)]
    drives = [{**drives[0], **bus}, {**drives[1], **second}, drives[2]]
    joints = tuple(replace(joint, drive=drive) for joint, drive in zip(robot.joints, drives, strict=True))
    return replace(robot, joints=joints, source=folder / "arm.yaml")


def refusal(call, *arguments: Any) -> str:
    with pytest.raises(AcquisitionError) as caught, translate_driver_errors():
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def frames_of(robot: Robot, bus: str, request: FrameRequest) -> list[PlannedFrame]:
    return list(find_bus(bus).plan_frames(to_drive_joints(find_bus(bus), robot), request))


def test_the_bus_that_the_drive_blocks_speak_of_is_found() -> None:
    assert select_bus(servo_arm()).name == "dynamixel"
    assert "no joint has a drive block" in refusal(select_bus, paper_arm())
    assert "did you mean 'dynamixel'" in refusal(find_bus, "dynamixl")


def test_sign_and_torque_constant_reach_the_driver_and_a_missing_one_does_not() -> None:
    constants = [joint.torque_per_unit for joint in to_drive_joints(find_bus("dynamixel"), servo_arm())]
    assert constants == [-0.002, 0.002, None]
    backend = make_backend("dynamixel", servo_arm(), {})
    assert backend.is_real_time
    assert backend.backend.capabilities.modes == {ControlMode.POSITION}, "torque needs every constant"
    assert backend.backend.capabilities.effort_unit == "mA"


def test_the_port_may_be_another_one_than_the_robot_files() -> None:
    joints = to_drive_joints(find_bus("dynamixel"), servo_arm(), {"port": "/dev/other"})
    assert joints[0].drive["port"] == "/dev/other"
    assert "port" not in joints[1].drive


@pytest.mark.parametrize(
    ("robot", "settings", "words"),
    [
        (paper_arm(), {}, "joint1 has no drive block"),
        (servo_arm(baud=1), {}, "joint1: drive.baud = 1"),
        (servo_arm(speed=1), {}, "drive.speed is not known"),
        (servo_arm(), {"prot": "x"}, "unknown setting 'prot'; did you mean 'port'"),
        (servo_arm(), {"patience_s": 0.0}, "patience_s is 0.0"),
        (servo_arm(), {"patience_s": "1"}, "patience_s is '1'"),
        (servo_arm(), {"patience_s": float("nan")}, "patience_s is nan"),
    ],
)
def test_what_cannot_be_a_backend_is_refused(robot: Robot, settings: dict[str, Any], words: str) -> None:
    assert words in refusal(make_backend, "dynamixel", robot, settings)


def test_frames_of_a_dry_run_come_without_a_port() -> None:
    limits = DriveLimits(np.full(3, -2.0), np.full(3, 2.0), np.full(3, 1.0), np.full(3, np.inf))
    request = FrameRequest(ControlMode.POSITION, limits, 0.1, np.zeros((2, 3)))
    frames = frames_of(servo_arm(), "dynamixel", request)
    assert [frame.phase for frame in frames if frame.phase == "cycle"] == ["cycle"] * 6
    nameless = replace(servo_arm().joints[0], drive={"id": 1, "port": "p"})
    robot = servo_arm()
    robot = replace(robot, joints=(nameless, *robot.joints[1:]))
    assert "drive.model is missing" in refusal(frames_of, robot, "dynamixel", request)


def test_a_drives_data_sheet_is_looked_up_beside_the_robot_file(tmp_path: Path) -> None:
    content = sections()
    content[GAIN]["ParameterValue"] = "250"
    (tmp_path / "files").mkdir()
    path = write_file(tmp_path / "files", content, "drive.dcf")
    robot = drive_arm(tmp_path, eds="files/drive.dcf")
    make_backend("canopen", robot, {})
    limits = DriveLimits(np.full(3, -2.0), np.full(3, 2.0), np.full(3, 1.0), np.full(3, 1.0))
    request = FrameRequest(ControlMode.POSITION, limits, 0.1, np.zeros((1, 3)))
    meanings = [frame.meaning for frame in frames_of(robot, "canopen", request)]
    assert "joint 2 (node 2): Gain (0x2001:00) := 250" in meanings
    del content["6064"]
    assert write_file(tmp_path / "files", content, "drive.dcf") == path
    words = f"joint2: drive.eds = {path!r}: Position actual value (0x6064:00) is missing"
    assert words in refusal(make_backend, "canopen", robot, {})
    assert words in refusal(find_bus("canopen").examine, to_drive_joints(find_bus("canopen"), robot))
    assert "there is no such file" in refusal(make_backend, "canopen", drive_arm(tmp_path / "files", eds="arm.eds"), {})
    assert "drive.eds = 3; give the path" in refusal(make_backend, "canopen", drive_arm(tmp_path, eds=3), {})


def test_a_missing_port_is_named_by_scan() -> None:
    assert "is not there" in refusal(list, find_bus("dynamixel").scan("/dev/nothing_there", [1_000_000]))


def test_a_policy_is_held_against_the_mode() -> None:
    capabilities = Capabilities(
        joint_count=1,
        modes=frozenset(ControlMode),
        stop_policies=frozenset([StopPolicy.HOLD, StopPolicy.TORQUE_OFF]),
        largest_rate_hz=200.0,
        watchdog_range_s=(0.02, 2.5),
        takes_feed_forward=False,
        policies_by_mode={
            ControlMode.POSITION: frozenset([StopPolicy.HOLD]),
            ControlMode.TORQUE: frozenset([StopPolicy.TORQUE_OFF]),
        },
        rate_limited_by="the wire takes 4 ms of each cycle, use a higher baud rate",
    )
    joints = paper_arm().joints
    assert choose_stop_policy(RunOptions(), joints, capabilities) is StopPolicy.HOLD
    torque = RunOptions(mode=ControlMode.TORQUE)
    assert "in mode torque; choose torque_off" in refusal(choose_stop_policy, torque, joints, capabilities)
    assert "the wire takes 4 ms" in refusal(choose_rate_hz, RunOptions(rate_hz=500.0), capabilities)
    assert choose_rate_hz(RunOptions(), capabilities) == 200.0
