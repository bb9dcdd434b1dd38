"""Recordings as people bring them: read, mended, or refused with the option that mends them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recording.recording_files import message_of
from shared_data import SHARED_CASES, SHARED_DATA, needs_shared_cases, needs_shared_data
from tauscope.identification import document, identify
from tauscope.recording import Reading, Recording, open_recording
from tauscope.robot import Robot, read_layout, read_robot

RECORDINGS = SHARED_CASES / "recordings"


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return read_robot(SHARED_CASES / "ur5" / "ur5.yaml")


@pytest.fixture(scope="module")
def held_out(ur5: Robot) -> Recording:
    return open_recording(SHARED_CASES / "ur5" / "ur5-held.csv", ur5)


READ = {
    "10-alphabetical-order": ({}, set()),
    "13-gripper-without-effort": ({}, set()),
    "14-second-publisher-zeros": ({}, {"other-publisher"}),
    "21-zstd": ({}, set()),
    "24-foxglove-jointstates.mcap": ({}, set()),
    "18-duplicate-stamp": ({}, {"time-stamps"}),
    "19-out-of-order": ({}, {"time-stamps"}),
    "35-time-iso.csv": ({}, set()),
    "35-time-ms.csv": ({"t": "ms"}, set()),
    "35-time-us.csv": ({"t": "us"}, set()),
    "35-time-ns.csv": ({"t": "ns"}, set()),
    "36-degrees.csv": ({"q": "deg"}, set()),
    "37-wrapped.csv": ({}, {"wrapped-angle"}),
    "38-duplicate-stamps.csv": ({}, {"time-stamps"}),
    "42-effort-dropouts.csv": ({}, {"effort-dropouts"}),
}


@needs_shared_cases
@pytest.mark.parametrize("name", READ)
def test_a_case_is_as_good_as_the_sound_recording(name: str, ur5: Robot, held_out: Recording) -> None:
    units, codes = READ[name]
    recording = open_recording(RECORDINGS / name, ur5, Reading(units))
    assert {warning.code for warning in recording.warnings} == codes
    fit = document(identify(ur5, [recording], [held_out])).fit.held_out
    assert fit is not None
    assert fit.relative_error < 0.0042  # 0.0040 of the sound recording


LAYOUTS = {
    "30-rtde.csv": ("rtde", {"commanded-effort"}),
    "31-franka.csv": ("libfranka", set()),
    "32-lerobot.parquet": ("lerobot", set()),
    "33-plotjuggler.csv": ("plotjuggler", set()),
    "34-decimal-comma.csv": (None, set()),
    "39-zero-based.csv": ({"q": "q{0}", "tau": "tau{0}"}, set()),
}


@pytest.fixture(scope="module")
def with_constants(ur5: Robot) -> Robot:
    """The currents of 32-lerobot are torque by 10 Nm/A."""
    joints = tuple(replace(joint, torque_constant=10.0, has_torque_constant=True) for joint in ur5.joints)
    return replace(ur5, joints=joints)


@needs_shared_cases
def test_milliamperes_are_told_by_the_stated_constants(with_constants: Robot) -> None:
    path = RECORDINGS / "43-current-without-constant.csv"
    joints = tuple(replace(joint, torque_constant=1e3) for joint in with_constants.joints)
    robot = replace(with_constants, joints=joints)
    doubt = message_of(lambda: open_recording(path, robot))
    assert "gravity of the stated masses: hardly in that unit; read it with --units tau=mA, or correct" in doubt
    for sound in (open_recording(path, with_constants), open_recording(path, robot, Reading({"tau": "mA"}))):
        assert sound.effort_kind == "i"


@needs_shared_cases
@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_of_another_tool_is_read(name: str, ur5: Robot, with_constants: Robot, held_out: Recording) -> None:
    columns, codes = LAYOUTS[name]
    robot = with_constants if "lerobot" in name else ur5
    recording = open_recording(RECORDINGS / name, robot, Reading(columns=columns))
    assert {warning.code for warning in recording.warnings} == codes
    fit = document(identify(robot, [recording], [held_out])).fit.held_out
    assert fit is not None
    assert fit.relative_error < 0.0042


@needs_shared_cases
@pytest.mark.parametrize("name", [name for name, (columns, _) in LAYOUTS.items() if columns is not None])
def test_the_mapping_of_a_refusal_works_when_pasted(
    name: str, ur5: Robot, with_constants: Robot, tmp_path: Path
) -> None:
    robot = with_constants if "lerobot" in name else ur5
    message = message_of(lambda: open_recording(RECORDINGS / name, robot))
    (tmp_path / "map.yaml").write_text(message[message.index("recording: {") :], encoding="utf-8")
    layout = read_layout(str(tmp_path / "map.yaml"))
    reading = Reading(columns=layout.columns, units=layout.units)
    sound = open_recording(SHARED_CASES / "ur5" / "ur5.csv", ur5).samples()
    found = open_recording(RECORDINGS / name, robot, reading)
    assert np.allclose(found.samples().position, sound.position, atol=1e-6)
    assert np.allclose(found.joint_torque(found.samples().effort, robot), sound.effort, atol=1e-4)


@needs_shared_cases
def test_positions_and_efforts_on_alternate_rows_are_read(ur5: Robot, held_out: Recording) -> None:
    recording = open_recording(RECORDINGS / "49-outer-join.csv", ur5)
    assert {warning.code for warning in recording.warnings} == {"held-samples"}
    fit = document(identify(ur5, [recording], [held_out])).fit.held_out
    assert fit is not None
    assert fit.relative_error < 0.006


REFUSED = {
    "16-effort-nan": ("columns tau1 to tau6: NaN throughout",),
    "35-time-ms.csv": ("column t", "--units t=ms"),
    "35-time-us.csv": ("column t", "--units t=us"),
    "35-time-ns.csv": ("column t", "--units t=ns"),
    "36-degrees.csv": ("column q2", "--units q=deg"),
    "43-milliampere-as-tau.csv": ("column tau2", "gravity of the stated masses", "--units tau=mA", "torque_constant"),
    "43-current-without-constant.csv": ("column i1", "torque_constant"),
    "43-magnitude.csv": ("column i1", "torque_constant"),
}


@needs_shared_cases
@pytest.mark.parametrize("name", REFUSED)
def test_a_case_is_refused_with_evidence_and_remedy(name: str, ur5: Robot) -> None:
    message = message_of(lambda: open_recording(RECORDINGS / name, ur5))
    assert message.startswith(f"{RECORDINGS / name}: ")
    for words in REFUSED[name]:
        assert words in message


@needs_shared_cases
def test_joints_that_the_robot_does_not_have_are_listed() -> None:
    robot = read_robot(SHARED_CASES / "ur5" / "ur5dh.yaml")
    message = message_of(lambda: open_recording(RECORDINGS / "10-alphabetical-order", robot))
    assert (
        "(elbow_joint, shoulder_lift_joint, shoulder_pan_joint, wrist_1_joint, wrist_2_joint, wrist_3_joint)" in message
    )
    assert "the robot has 6 (joint1, joint2, joint3, joint4, joint5, joint6)" in message


@needs_shared_cases
def test_a_magnitude_is_told_without_the_robot() -> None:
    assert "this is a magnitude" in message_of(lambda: open_recording(RECORDINGS / "43-magnitude.csv"))


def sound_files() -> list[Path]:
    folders = [*SHARED_DATA.glob("*"), *SHARED_CASES.glob("arms/*"), SHARED_CASES / "ur5"]
    return [file for folder in folders for file in sorted([*folder.glob("*.csv"), *folder.glob("*.db3")])]


@needs_shared_data
@needs_shared_cases
@pytest.mark.parametrize("path", sound_files(), ids=lambda path: f"{path.parent.name}/{path.name}")
def test_recordings_of_real_arms_are_not_refused(path: Path) -> None:
    robot = next(file for file in (path.with_name("robot.yaml"), path.with_name("ur5.yaml")) if file.is_file())
    recording = open_recording(path, read_robot(robot))
    open_recording(path)
    assert {warning.code for warning in recording.warnings} <= {"spikes"}
