"""A refinement finds what the real arm has, leaves out what it lacks, and says whether it wins."""

from dataclasses import replace

import numpy as np
import pytest

from arms import arm, dh_segment
from tauscope.closed_loop import roll_out
from tauscope.closed_loop.batch import Variants, simulate_segments
from tauscope.closed_loop.laws import RELAXED, LoadFriction
from tauscope.closed_loop.model import rollout_model, stated_model
from tauscope.closed_loop.plant import STEP_S, make_plant
from tauscope.closed_loop.refine import refine_model
from tauscope.closed_loop.segments import Segments
from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.export.compensation.model import JointFriction
from tauscope.export.model import ExportModel
from tauscope.recording import EffortKind, Recording
from tauscope.robot import Actuator, LinkInertia, Model, Robot

KP, KD = 40.0, 1.0
DRIVING, BRAKING = 0.12, 0.25


def _robot(joints: int = 1) -> Robot:
    robot = arm("pendulum", [dh_segment(0.0, 0.0, 0.3, 0.0)] * joints, (9.81, 0.0, 0.0))
    link = LinkInertia(0.8, np.array([-0.08, 0.0, 0.0]), np.diag([1e-3, 0.016, 0.016]))
    loop = Actuator("position", KP, KD, delay=0.0)
    return replace(
        robot, joints=tuple(replace(each, actuator=loop) for each in robot.joints), model=Model(links=(link,) * joints)
    )


def _model(robot: Robot, stiction: float = 0.08, viscous: float = 0.1) -> ExportModel:
    stated = stated_model(robot)
    assert stated is not None
    friction = tuple(JointFriction(stiction, 0.0, viscous, 0.0, 500.0) for _ in robot.joints)
    return replace(stated, friction=friction, delivered_friction=friction)


def _record(model: ExportModel, by_load: LoadFriction | None, seconds: float, seed: int) -> Recording:
    """Counts of an encoder and commands of an arm in MuJoCo."""
    real, joints = rollout_model("identified", model, by_load), model.robot.joint_count
    plant = make_plant(real.mjcf, real.joints, np.zeros(joints))
    rng, time = np.random.default_rng(seed), np.arange(0.0, seconds, STEP_S)
    rates = 2.0 * np.pi * np.arange(1, 8) / 4.0
    phases = rng.uniform(0.0, 6.28, (joints, 7))
    command = np.stack([np.sin(np.outer(time, rates) + each) @ (0.5 / np.sqrt(np.arange(1, 8))) for each in phases], 1)
    plant.reset(command[0], np.zeros(joints))
    positions, load = np.empty_like(command), plant.load.copy()
    for step in range(len(time)):
        position, velocity = plant.position.copy(), plant.velocity.copy()
        positions[step] = position
        torque = KP * (command[step] - position) - KD * velocity
        dry, against = real.laws(position, velocity, load, torque)
        plant.advance(torque - against, dry)
        load = (1.0 - RELAXED) * load + RELAXED * plant.load
    counts = np.round(positions / 1.5e-3) * 1.5e-3
    kept = slice(None, None, 5)
    return Recording.from_arrays(
        f"seed {seed}", time[kept], counts[kept], command[kept], effort_kind=EffortKind.COMMAND
    )


@pytest.mark.slow
def test_friction_by_load_is_found_and_wins() -> None:
    robot = _robot()
    by_load = LoadFriction(np.array([DRIVING]), np.array([BRAKING]))
    train, judge = (_record(_model(robot), by_load, 6.0, seed) for seed in (1, 2))
    document = roll_out(robot, [judge], [_model(robot, stiction=0.25, viscous=0.2)], training=[train]).document
    assert [entry.model for entry in document.summary] == ["stated", "identified", "refined"]
    assert document.summary[-1].rms[0] < 0.2 * document.summary[-2].rms[0]
    assert document.refinement is not None
    assert document.refinement.is_better
    assert document.refinement.rms_after < 2e-3
    found = {each.name.rpartition(" ")[0]: each for each in document.refinement.parameters}
    assert found["driving friction"].value == pytest.approx(DRIVING, rel=0.25)
    assert found["braking friction"].value == pytest.approx(BRAKING, rel=0.25)
    for name in ("driving friction", "braking friction"):
        p_value = found[name].p_value
        assert p_value is not None
        assert p_value < 1e-3


@pytest.mark.slow
def test_friction_by_load_that_is_not_there_is_left_out() -> None:
    robot = _robot()
    refined = refine_model(_model(robot, 0.2, 0.2), _loops(robot), [_record(_model(robot), None, 6.0, 1)])
    assert set(refined.left_out) == {"driving friction joint1", "braking friction joint1"}
    assert refined.model.friction[0].stiction == pytest.approx(0.08, rel=0.15)
    assert refined.model.friction[0].viscous == pytest.approx(0.1, rel=0.15)
    assert refined.after < 0.3 * refined.before


def test_segments_move_as_in_mujoco() -> None:
    """Two coupled joints with dry friction and friction by load."""
    robot = _robot(2)
    model = _model(robot)
    by_load = LoadFriction(np.array([DRIVING, 0.0]), np.array([0.0, BRAKING]))
    segments = Segments.of([_record(model, by_load, 4.0, 3)], _loops(robot))
    law = model.friction
    found = simulate_segments(
        robot,
        _loops(robot),
        segments,
        Variants(
            links=np.concatenate([link.to_vector() for link in model.links])[None],
            rotor=np.zeros((1, 2)),
            stiction=np.array([[each.stiction for each in law]]),
            viscous=np.array([[each.viscous for each in law]]),
            offset=np.zeros((1, 2)),
            stribeck=np.zeros(2),
            delta=np.zeros(2),
            driving=by_load.driving[None],
            braking=by_load.braking[None],
            slope=np.zeros(1),
        ),
    )
    # Speeds of 10 rad/s begin from differences of counts of 1.5 mrad.
    assert np.sqrt(np.mean((found[..., 0] - segments.position) ** 2)) < 5e-3


def test_a_refinement_needs_commands() -> None:
    robot = _robot()
    judge = _record(_model(robot), None, 1.0, 1)
    samples = judge.samples()
    torque = Recording.from_arrays("torque.csv", samples.time, samples.position, samples.effort)
    with pytest.raises(RecordingMismatchError, match=r"torque\.csv: a refinement needs commands .* record qref"):
        roll_out(robot, [judge], [_model(robot)], training=[torque])


def test_a_recording_without_a_segment_is_named() -> None:
    robot = _robot()
    with pytest.raises(RecordingError, match=r"seed 1: no piece of 0\.3 s"):
        refine_model(_model(robot), _loops(robot), [_record(_model(robot), None, 0.2, 1)])


def _loops(robot: Robot) -> tuple[Actuator, ...]:
    return tuple(joint.actuator for joint in robot.joints if joint.actuator is not None)


def test_recordings_with_and_without_a_gain_go_together() -> None:
    robot = _robot()
    plain = _record(_model(robot), None, 1.0, 1)
    samples = plain.samples()
    other = Recording.from_arrays(
        "gain",
        samples.time,
        samples.position,
        samples.effort,
        effort_kind=EffortKind.COMMAND,
        gain=np.full_like(samples.position, 2.0 * KP),
    )
    segments = Segments.of([plain, other], _loops(robot))
    assert np.unique(segments.gain).tolist() == [KP, 2.0 * KP]
    assert segments.mean_temperature is None
    assert segments.warmth is None
