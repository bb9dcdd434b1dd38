"""Torque made of commands: the loop's law, its delay, and the same parameters as from recorded torque."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tauscope
from arms import arm, dh_segment
from shared_data import SHARED_DATA, needs_shared_data
from tauscope.actuation import make_efforts
from tauscope.dynamics import torque_regressor
from tauscope.errors import RecordingError, RobotFileError
from tauscope.recording import EffortKind, Recording
from tauscope.recording.examination.examine import examine_recording
from tauscope.robot import Actuator, LinkInertia, Model, Robot, read_robot, robot_from_dict, robot_to_dict

RATE_HZ = 200.0
STIFFNESS = (60.0, 25.0)
LATE_S = (0.018, 0.011)


def _arm(scale_std: float = 0.0) -> Robot:
    robot = arm("two", [dh_segment(0.0, 0.0, 0.3, 0.0), dh_segment(0.0, 0.0, 0.2, 0.0)], (0.0, -9.81, 0.0))
    joints = [
        replace(joint, actuator=Actuator("position", kp, scale_std=scale_std))
        for joint, kp in zip(robot.joints, STIFFNESS, strict=True)
    ]
    return replace(robot, joints=tuple(joints))


def _recordings(robot: Robot, seed: int = 1) -> tuple[Recording, Recording]:
    """The same motion, with its torque, and with the commands that make it through the loops, late as the bus is."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 24.0, 1.0 / RATE_HZ)
    base = 2.0 * np.pi / 8.0
    amplitudes, phases = rng.uniform(0.1, 0.25, (2, 6)), rng.uniform(0.0, 6.28, (2, 6))
    bodies = [LinkInertia(0.6, np.array([-0.09, 0.0, 0.0]), np.diag([1e-3, 0.02, 0.02])) for _ in range(2)]
    parameters = np.concatenate([body.to_vector() for body in bodies])

    def motion(at: np.ndarray) -> tuple[np.ndarray, ...]:
        angles = [base * k * at[:, None] + phases[:, k - 1] for k in range(1, 7)]
        slopes = [base * k for k in range(1, 7)]
        parts = [
            sum(a * f(x) * s**n for a, x, s in zip(amplitudes.T, angles, slopes, strict=True))
            for n, f in enumerate((np.sin, np.cos, lambda x: -np.sin(x)))
        ]
        return tuple(np.asarray(part) for part in parts)

    def torque(at: np.ndarray) -> np.ndarray:
        q, qd, qdd = motion(at)
        rigid = torque_regressor(robot, q, qd, qdd) @ parameters
        return rigid + 0.08 * 2.0 / np.pi * np.arctan(300.0 * qd) + 0.05 * qd

    commands = np.stack(
        [
            (motion(time + late)[0] + torque(time + late) / kp)[:, joint]
            for joint, (kp, late) in enumerate(zip(STIFFNESS, LATE_S, strict=True))
        ],
        axis=1,
    )
    position = motion(time)[0] + rng.normal(0.0, 2e-4, (len(time), 2))
    measured = torque(time) + rng.normal(0.0, 0.01, (len(time), 2))
    return (
        Recording.from_arrays("torque", time, position, measured),
        Recording.from_arrays("commands", time, position, commands, effort_kind=EffortKind.COMMAND),
    )


def test_delays_of_commands_are_estimated() -> None:
    robot = _arm()
    driven, (made,), _ = make_efforts(robot, [_recordings(robot)[1]])
    found = [joint.actuator.delay or 0.0 for joint in driven.joints if joint.actuator]
    np.testing.assert_allclose(found, LATE_S, atol=2e-3)
    assert made.effort_kind is EffortKind.TORQUE
    assert [note.code for note in driven.notes] == ["made-effort", "effort-scale"] * 2
    assert "estimated" in driven.notes[0].text
    assert made.effort_std == (0.0, 0.0)


def test_parameters_are_those_of_recorded_torque_within_their_errors() -> None:
    robot = _arm()
    with_torque, with_commands = _recordings(robot)
    expected = tauscope.identify(robot, examine_recording(with_torque, robot)).to_dict()["base_parameters"]
    found = tauscope.identify(robot, examine_recording(with_commands, robot)).to_dict()
    for one, other in zip(found["base_parameters"], expected, strict=True):
        assert abs(one["value"] - other["value"]) < 3.0 * np.hypot(one["std"], other["std"]) + 0.01 * abs(
            other["value"]
        )
    assert {"made-effort", "effort-scale"} <= {warning["code"] for warning in found["warnings"]}


def test_uncertain_gains_make_uncertain_parameters() -> None:
    stds = []
    for std in (0.0, 0.2):
        robot = _arm(scale_std=std)
        recording = examine_recording(_recordings(robot)[1], robot)
        found = tauscope.identify(robot, recording, prior=False).to_dict()["base_parameters"]
        heaviest = max(found, key=lambda each: abs(each["value"] / max(each["std"], 1e-12)))
        stds.append(heaviest["std"] / abs(heaviest["value"]))
    assert stds[0] < 0.05
    assert 0.1 < stds[1] < 0.4  # 20 % of both joints, in part averaged


def test_stated_masses_tell_the_torque_per_volt() -> None:
    """Servos of an unknown motor: gravity of the stated links, and not the joint whose motion it does not feel."""
    bodies = LinkInertia(0.6, np.array([-0.09, 0.0, 0.0]), np.diag([1e-3, 0.02, 0.02]))
    robot = _arm()
    recording = _recordings(robot)[1]
    unit = Actuator("position", 1.0, unit="register", servo="dynamixel-x", supply_voltage=12.0, torque_per_volt=1.0)
    assert unit.stiffness is not None
    loops = [replace(unit, kp=kp / unit.stiffness / 0.4, torque_per_volt=None, max_duty=1.0) for kp in STIFFNESS]
    joints = tuple(replace(joint, actuator=loop) for joint, loop in zip(robot.joints, loops, strict=True))
    robot = replace(robot, joints=joints, model=Model(links=(bodies, bodies)))
    driven, (made,), _ = make_efforts(robot, [recording])
    found = [joint.actuator.torque_per_volt or 0.0 for joint in driven.joints if joint.actuator]
    np.testing.assert_allclose(found, 0.4, rtol=0.03)
    assert made.effort_std == (0.1, 0.1)
    assert "by the stated masses" in driven.notes[1].text


def test_register_gain_saturates_at_the_supply() -> None:
    loop = Actuator(
        "position", 400, unit="register", servo="dynamixel-xl330", supply_voltage=7.4, torque_per_volt=0.0873
    )
    error = np.array([0.1, 3.0])
    linear = 0.0873 * 7.4 * 400 * 0.1 * 4096 / (2.0 * np.pi) / 256 / 885
    np.testing.assert_allclose(loop.torque(error, np.zeros(2)), [linear, 0.0873 * 7.4])
    assert loop.stiffness == pytest.approx(10.0 * linear)


def test_a_warm_motor_gives_less_torque_per_volt() -> None:
    loop = Actuator("position", 400, unit="register", supply_voltage=7.4, torque_per_volt=0.1, temperature_slope=0.02)
    error, still = np.full(4, 0.1), np.zeros(4)
    cold = np.asarray(loop.torque(error, still))
    warm = np.asarray(loop.torque(error, still, temperature=np.array([25.0, 75.0, np.nan, 0.0])))
    np.testing.assert_allclose(warm / cold, [1.0, 0.5, 1.0, 2.0])


def test_dead_band_of_a_feetech_servo() -> None:
    loop = Actuator("position", 16, unit="register", servo="feetech-sts3215", supply_voltage=7.4)
    np.testing.assert_array_equal(np.sign(loop.torque(np.array([1e-3, 2e-3]), np.zeros(2))), [0.0, 1.0])


def test_robot_file_and_model_file_keep_the_actuator(tmp_path: Path) -> None:
    text = """
name: one
kinematics: {dh: [{theta: 0, d: 0, a: 0.1, alpha: 0}]}
joints:
  - name: servo
    actuator: {kind: position, kp: 400, kd: 0, unit: register, supply_voltage: 7.4, torque_per_volt: 0.0873,
               max_duty: 1.0, delay: null}
"""
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    robot = read_robot(path)
    loop = robot.joints[0].actuator
    assert loop is not None
    assert (loop.kind, loop.kp, loop.unit, loop.delay) == ("position", 400.0, "register", None)
    assert robot_from_dict(robot_to_dict(robot)).joints == robot.joints


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{kind: position}", "needs kp"),
        ("{kind: pid, kp: 1}", "write one of torque, position, velocity"),
        ("{kind: position, kp: 1, unit: Nm/rad}", "register, Nm_per_rad"),
        ("{kind: position, kp: 1, servo: sts}", "feetech-sts3215"),
        ("{kind: position, kp: 1, max_duty: 97}", "share"),
        ("{kind: position, kp: -1}", "above zero"),
    ],
)
def test_refused_actuators_say_the_remedy(entry: str, words: str, tmp_path: Path) -> None:
    text = "name: one\nkinematics: {dh: [{theta: 0, d: 0, a: 0.1, alpha: 0}]}\njoints: [{name: j, actuator: %s}]\n"
    path = tmp_path / "arm.yaml"
    path.write_text(text % entry)
    with pytest.raises(RobotFileError, match=words):
        read_robot(path)


@pytest.mark.parametrize(
    ("actuator", "words"),
    [
        (None, r"joint 1 \(joint1\) has no loop that makes torque of qref1"),
        (Actuator("torque"), "has no loop"),
        (Actuator("position", 4, unit="register", servo="dynamixel-x"), "actuator.supply_voltage, or record volt1"),
        (Actuator("position", 4, unit="register", servo="dynamixel-x", supply_voltage=12.0), "torque_per_volt"),
    ],
)
def test_commands_without_a_loop_are_refused(actuator: Actuator | None, words: str) -> None:
    robot = arm("one", [dh_segment(0.0, 0.0, 0.1, 0.0)])
    robot = replace(robot, joints=(replace(robot.joints[0], actuator=actuator),))
    time = np.arange(50.0) / 50.0
    wave = np.sin(time)[:, None]
    recording = Recording.from_arrays("log.csv", time, wave, wave, effort_kind=EffortKind.COMMAND)
    with pytest.raises(RecordingError, match=words):
        make_efforts(robot, [recording])


def test_file_of_positions_and_commands(tmp_path: Path) -> None:
    """Rest, repeats and zeros of a command are its own; a torque of nothing but NaN or zero gives way to commands."""
    robot = _arm()
    samples = _recordings(robot)[1].samples()
    plain = np.column_stack([samples.time, samples.position, samples.effort])
    nothing = np.full((len(plain), 2), np.nan)
    for name, header, data in (
        ("plain", "t,q1,q2,qref1,qref2", plain),
        ("nan", "t,q1,q2,tau1,tau2,qref1,qref2", np.column_stack([plain[:, :3], nothing, plain[:, 3:]])),
        ("zero", "t,q1,q2,tau1,tau2,qref1,qref2", np.column_stack([plain[:, :3], 0.0 * plain[:, 3:], plain[:, 3:]])),
    ):
        path = tmp_path / f"{name}.csv"
        np.savetxt(path, data, delimiter=",", header=header, comments="")
        recording = tauscope.read_recording(path, robot)
        assert recording.effort_kind is EffortKind.COMMAND
        np.testing.assert_allclose(recording.samples().effort, samples.effort)
        assert recording.notes == ()


def test_commands_follow_the_unit_of_the_positions(tmp_path: Path) -> None:
    """Degrees for both; a unit of torque that the robot file states changes no command."""
    robot = _arm()
    samples = _recordings(robot)[1].samples()
    degrees = np.rad2deg(np.column_stack([samples.position, samples.effort]))
    path = tmp_path / "log.csv"
    header = "t,q1,q2,qref1,qref2"
    np.savetxt(path, np.column_stack([samples.time, degrees]), delimiter=",", header=header, comments="")
    recording = tauscope.read_recording(path, robot, units={"q": "deg", "tau": "mA"})
    assert recording.effort_kind is EffortKind.COMMAND
    np.testing.assert_allclose(recording.samples().effort, samples.effort)


def test_lerobot_layout_without_effort_is_read(tmp_path: Path) -> None:
    """``action`` is the command: a LeRobot data set of position servos has no effort."""
    robot = _arm()
    samples = _recordings(robot)[1].samples()
    degrees = np.rad2deg(np.column_stack([samples.position, samples.effort]))
    path = tmp_path / "episode.csv"
    names = ["timestamp", *(f"{group}.{j - 1}" for group in ("observation.state", "action") for j in (1, 2))]
    np.savetxt(path, np.column_stack([samples.time, degrees]), delimiter=",", header=",".join(names), comments="")
    recording = tauscope.read_recording(path, robot, columns="lerobot")
    assert recording.effort_kind is EffortKind.COMMAND
    np.testing.assert_allclose(recording.samples().effort, samples.effort)


def test_a_delay_that_the_motion_does_not_tell_is_not_claimed() -> None:
    robot = _arm()
    time = np.arange(0.0, 4.0, 0.01)
    still = np.zeros((len(time), 2))
    rng = np.random.default_rng(0)
    recording = Recording.from_arrays(
        "still", time, still + rng.normal(0.0, 1e-4, still.shape), still, effort_kind=EffortKind.COMMAND
    )
    driven, (made,), _ = make_efforts(robot, [recording])
    assert all(joint.actuator and joint.actuator.delay is not None for joint in driven.joints)
    assert np.isfinite(made.samples().effort).all()


def test_file_of_commands_without_actuator_says_what_to_state(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    time = np.arange(0.0, 4.0, 0.01)
    np.savetxt(
        path, np.column_stack([time, np.sin(time), np.sin(time)]), delimiter=",", header="t,q1,qref1", comments=""
    )
    robot = arm("one", [dh_segment(0.0, 0.0, 0.1, 0.0)])
    with pytest.raises(RecordingError, match=r"joints\[0\].actuator"):
        tauscope.identify(robot, path)


@needs_shared_data
def test_made_effort_follows_the_measured_one_of_a_real_servo() -> None:
    """Commands and gain alone against volts across the bridge, which the servo measured."""
    folder = SHARED_DATA / "bam-xl330"
    robot = tauscope.load_robot(folder / "robot.yaml")
    loop = Actuator(
        "position", 100, unit="register", servo="dynamixel-xl330", supply_voltage=7.2, torque_per_volt=0.0873
    )
    robot = replace(robot, joints=(replace(robot.joints[0], actuator=loop),))
    gains = {"train-1": 100, "train-6": 400, "held-out-1": 200, "held-out-6": 800}
    for name, gain in gains.items():
        samples = tauscope.read_recording(folder / f"{name}.csv", robot).samples()
        assert samples.reference is not None
        recording = Recording.from_arrays(
            name,
            samples.time,
            samples.position,
            samples.reference,
            effort_kind=EffortKind.COMMAND,
            gain=np.full_like(samples.position, gain),
        )
        _, (made,), _ = make_efforts(robot, [recording])
        both = np.isfinite(samples.effort[:, 0])
        measured, effort = 0.0873 * samples.effort[both, 0], made.samples().effort[both, 0]
        assert np.corrcoef(measured, effort)[0, 1] > 0.97
        assert np.std(effort) / np.std(measured) == pytest.approx(1.0, abs=0.04)
