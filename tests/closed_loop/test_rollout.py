"""Rollouts against MuJoCo driven by the test itself: the same motion, and errors that are the model's own."""

# pyright: reportAttributeAccessIssue=false

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from arms import arm, dh_segment
from tauscope.closed_loop import roll_out
from tauscope.closed_loop.model import rollout_model, stated_model
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.errors import RecordingMismatchError, TauscopeError
from tauscope.export.actuators import ActuatorChoice, ActuatorKind
from tauscope.export.compensation.model import JointFriction
from tauscope.export.mjcf import to_mjcf
from tauscope.export.model import ExportModel, FoundEffect
from tauscope.recording import Recording
from tauscope.robot import Actuator, LinkInertia, Model, Robot

KP, KD = (30.0, 12.0), (1.0, 0.4)
STEP_S = 1e-3


def _robot() -> Robot:
    robot = arm("two", [dh_segment(0.0, 0.0, 0.3, 0.0), dh_segment(0.0, 0.0, 0.2, 0.0)], (0.0, -9.81, 0.0))
    link = LinkInertia(0.5, np.array([-0.06, 0.0, 0.0]), np.diag([1e-3, 0.012, 0.012]))
    joints = [
        replace(joint, actuator=Actuator("position", kp, kd, delay=0.0))
        for joint, kp, kd in zip(robot.joints, KP, KD, strict=True)
    ]
    return replace(robot, joints=tuple(joints), model=Model(links=(link, link)))


def _model(robot: Robot, *effects: FoundEffect, dry: float = 0.15, offset: float = 0.0) -> ExportModel:
    stated = stated_model(robot)
    assert stated is not None
    friction = tuple(JointFriction(dry, 0.0, 0.05, offset, 500.0) for _ in robot.joints)
    return replace(stated, friction=friction, delivered_friction=friction, effects=effects)


def _command(time: np.ndarray) -> np.ndarray:
    """Several waves, up to 3 Hz."""
    waves = [(0.5, 1.5), (0.2, 6.1), (0.06, 18.0)], [(0.4, 2.3), (0.2, 7.7), (0.08, 15.0)]
    return np.stack([sum(a * np.sin(w * time) for a, w in own) for own in waves], axis=1)


def _record(model: ExportModel, seconds: float = 4.0, actuator: ActuatorKind = ActuatorKind.MOTOR) -> Recording:
    """An exported MJCF, pasted: with motors the loop is the test's own, with position servos MuJoCo's."""
    mj = mujoco.MjModel.from_xml_string(to_mjcf(model, ActuatorChoice(actuator)).text)
    mj.opt.timestep, mj.opt.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(mj)
    time = np.arange(0.0, seconds, STEP_S)
    command = _command(time)
    positions, velocities, torques = (np.empty_like(command) for _ in range(3))
    for step in range(len(time)):
        positions[step], velocities[step] = data.qpos, data.qvel
        torques[step] = np.array(KP) * (command[step] - data.qpos) - np.array(KD) * data.qvel
        data.ctrl[:] = torques[step] if actuator is ActuatorKind.MOTOR else command[step]
        mujoco.mj_step(mj, data)
    return Recording.from_arrays("real", time, positions, torques, velocity=velocities, reference=command)


@pytest.mark.parametrize("actuator", [ActuatorKind.MOTOR, pytest.param(ActuatorKind.POSITION, marks=pytest.mark.slow)])
def test_a_pasted_mjcf_gives_the_same_motion(actuator: ActuatorKind) -> None:
    """Within 1e-6 rad of the rollout, in plain MuJoCo with 1 ms and implicitfast."""
    robot = _robot()
    if actuator is ActuatorKind.POSITION:  # the loop is that of the user's MJCF
        robot = replace(robot, mjcf=Path("arm.xml"))
    model = _model(robot)
    found = roll_out(robot, [_record(model, actuator=actuator)], [model])
    entry = found.document.recordings[0].models[-1]
    assert found.document.drive == "loop"
    assert entry.model == "identified"
    assert max(entry.worst) < 1e-6


def test_a_finding_takes_the_error_away() -> None:
    robot = _robot()
    spring = FoundEffect(JointSpring(0), np.array([3.0]), np.zeros(0))
    real = _record(_model(robot, spring))
    found = roll_out(robot, [real], [_model(robot), _model(robot, spring)])
    stated, identified, findings = (entry.rms for entry in found.document.summary)
    assert [entry.model for entry in found.document.summary] == ["stated", "identified", "findings"]
    assert max(findings) < 1e-6
    assert identified[0] > 0.02
    assert stated[0] > 0.02
    horizons = found.document.recordings[0].models[1].horizons
    assert horizons[0].rms[0] < horizons[-1].rms[0]


def test_load_dependent_friction_acts_beside_the_mjcf() -> None:
    """A level of mu times the load, found by moving frictionloss at every step."""
    robot = _robot()
    slip = FoundEffect(LoadDependentFriction(0), np.array([0.3]), np.zeros(0))
    model = rollout_model("findings", _model(robot, slip, dry=0.1))
    position, still = np.array([0.3, 0.0]), np.zeros(2)
    load = np.array([2.0, 1.0])
    for velocity in (still, np.array([1.0, 0.0]), np.array([-1.0, 0.0])):
        dry, torque = model.laws(position, velocity, load, np.array([3.0, 0.0]))
        np.testing.assert_allclose(dry, [0.1 + 0.3 * 2.0, 0.1])
        np.testing.assert_allclose(torque, 0.0)
    assert model.left_out == ()


def test_a_resting_joint_rests() -> None:
    """Dry friction above the torque holds for as long as it lasts."""
    robot = _robot()
    text = to_mjcf(_model(replace(robot, gravity=np.zeros(3)), dry=0.3)).text
    mj = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(mj)
    data.ctrl[:] = 0.2
    for _ in range(2500):
        mujoco.mj_step(mj, data)
    assert np.abs(data.qpos).max() < 1e-3


@pytest.mark.slow
def test_constant_torque_counts() -> None:
    robot = _robot()
    quiet, pulled = _model(robot), _model(robot, offset=0.4)
    found = roll_out(robot, [_record(quiet)], [pulled])
    assert found.document.summary[-1].rms[0] > 5e-3


@pytest.mark.slow
def test_recorded_torque_drives_where_no_loop_is_stated() -> None:
    robot = _robot()
    model = _model(robot)
    plain = replace(robot, joints=tuple(replace(joint, actuator=None) for joint in robot.joints))
    document = roll_out(plain, [_record(model)], [model]).document
    assert document.drive == "torque"
    assert [warning.code for warning in document.warnings] == ["stabiliser"]
    entry = document.recordings[0].models[-1]
    assert entry.stabiliser_rms is not None
    assert max(entry.rms) < 5e-3


@pytest.mark.slow
def test_a_delay_that_nothing_states_is_estimated() -> None:
    robot = _robot()
    real = _record(_model(robot), 4.0)
    samples = real.samples()
    late = Recording.from_arrays(
        "late",
        samples.time,
        samples.position,
        samples.effort,
        velocity=samples.velocity,
        reference=_command(samples.time + 0.03),
    )
    loops = tuple(
        replace(joint, actuator=replace(joint.actuator, delay=None)) for joint in robot.joints if joint.actuator
    )
    open_robot = replace(robot, joints=loops)
    document = roll_out(open_robot, [late], [_model(open_robot)]).document
    delays = [delay or 0.0 for delay in document.delay]
    np.testing.assert_allclose(delays, 0.03, atol=3e-3)
    assert max(document.summary[-1].rms) < 5e-3


def test_without_a_model_it_says_how_to_get_one() -> None:
    robot = replace(_robot(), model=Model())
    with pytest.raises(RecordingMismatchError, match=r"--model MODEL\.json"):
        roll_out(robot, [_record(_model(_robot()), 0.2)])


def test_a_model_of_another_arm_is_refused() -> None:
    robot, model = _robot(), _model(_robot())
    other = replace(robot, joints=tuple(replace(joint, name=f"other{joint.name}") for joint in robot.joints))
    with pytest.raises(TauscopeError, match="give the model of this arm"):
        roll_out(other, [_record(model, 0.2)], [model])


@pytest.mark.parametrize(
    ("loop", "words"),
    [
        (Actuator("position", 400, unit="register", servo="dynamixel-xl330"), "supply_voltage"),
        (Actuator("position", 400, unit="register", servo="dynamixel-x", supply_voltage=12.0), "torque_per_volt"),
    ],
)
def test_a_loop_that_makes_no_torque_is_refused(loop: Actuator, words: str) -> None:
    model = _model(_robot())
    robot = replace(_robot(), joints=tuple(replace(joint, actuator=loop) for joint in _robot().joints))
    with pytest.raises(TauscopeError, match=words):
        roll_out(robot, [_record(model, 0.2)], [model])
