"""MuJoCo's arm against closed forms, against Pinocchio, and against the conservation of energy."""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo and Pinocchio are extension modules without type stubs)

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest

from arms import Array, arm, dh_segment, random_arm, random_link, random_states
from tauscope.errors import RobotFileError
from tauscope.robot import nearest_body
from tauscope.robot.robot import JointType, LinkInertia, Model, Robot
from tauscope_sim.model import build_model, build_spec
from tauscope_sim.recording import rigid_body_torque


def with_links(robot: Robot, *links: LinkInertia) -> Robot:
    return replace(robot, model=Model(links=links))


def random_robot(rng: np.random.Generator, joint_count: int) -> Robot:
    return with_links(random_arm(rng, joint_count), *(random_link(rng) for _ in range(joint_count)))


def one_joint(link: LinkInertia, gravity: tuple[float, float, float]) -> Robot:
    return with_links(arm("one", [dh_segment(0.0, 0.0, 0.0, 0.0)], gravity), link)


def pinocchio_torque(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Pinocchio's recursive Newton-Euler, its links about the frame between `before` and the joint."""
    model = pinocchio.Model()
    model.gravity.linear = robot.gravity
    parent, reach = 0, pinocchio.SE3.Identity()
    assert robot.model.links is not None
    for joint, segment, link in zip(robot.joints, robot.segments, robot.model.links, strict=True):
        before = pinocchio.SE3(segment.before.rotation, segment.before.translation)
        after = pinocchio.SE3(segment.after.rotation, segment.after.translation)
        kind = pinocchio.JointModelRZ() if segment.type is JointType.REVOLUTE else pinocchio.JointModelPZ()
        parent = model.addJoint(parent, kind, reach * before, joint.name)
        centre = link.first_moment / link.mass if link.mass else np.zeros(3)
        about_centre = link.inertia - link.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        model.appendBodyToJoint(parent, pinocchio.Inertia(link.mass, centre, about_centre), after)
        reach = after
    data = model.createData()
    return np.array([pinocchio.rnea(model, data, *row) for row in zip(q, qd, qdd, strict=True)])


def test_pendulum_matches_its_closed_form(rng: np.random.Generator) -> None:
    mass, centre, moment = 2.3, 0.4, 0.5
    link = LinkInertia(mass, np.array([mass * centre, 0.0, 0.0]), np.diag([0.01, moment, moment]))
    q, qd, qdd = random_states(rng, 50, 1)
    torque = rigid_body_torque(build_model(one_joint(link, (0.0, -9.81, 0.0))), q, qd, qdd)
    np.testing.assert_allclose(torque, moment * qdd + mass * centre * 9.81 * np.cos(q), rtol=1e-11, atol=1e-10)


def test_lifted_mass_matches_its_closed_form(rng: np.random.Generator) -> None:
    link = LinkInertia(3.0, np.array([0.3, -0.2, 0.1]), np.diag([0.2, 0.2, 0.2]))
    robot = with_links(arm("lift", [dh_segment(0.0, 0.0, 0.0, 0.0, JointType.PRISMATIC)]), link)
    q, qd, qdd = random_states(rng, 50, 1)
    torque = rigid_body_torque(build_model(robot), q, qd, qdd)
    np.testing.assert_allclose(torque, 3.0 * (qdd + 9.81), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("joint_count", [1, 3, 6, 7])
def test_random_arms_match_pinocchio(rng: np.random.Generator, joint_count: int) -> None:
    for _ in range(3):
        robot = random_robot(rng, joint_count)
        states = random_states(rng, 40, joint_count)
        expected = pinocchio_torque(robot, *states)
        torque = rigid_body_torque(build_model(robot), *states)
        assert np.abs(torque - expected).max() <= 1e-9 * np.abs(expected).max()


def test_paper_arm_matches_pinocchio_despite_regularisation(paper: Robot, rng: np.random.Generator) -> None:
    """Pinocchio takes the massless link and the slender rods as they are; MuJoCo needs a hair of inertia."""
    states = random_states(rng, 500, 3)
    difference = rigid_body_torque(build_model(paper), *states) - pinocchio_torque(paper, *states)
    assert np.abs(difference).max() < 1e-9


def test_paper_arm_upright_leaves_no_warning(
    paper: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Upright the rods lie on the first axis and its inertia vanishes: MuJoCo must not write its warning log."""
    monkeypatch.chdir(tmp_path)
    rest = np.zeros((1, 3))
    torque = rigid_body_torque(build_model(paper), rest, rest, np.ones((1, 3)))
    assert abs(torque[0, 0]) < 1e-9
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_forward_dynamics_undoes_inverse_dynamics(rng: np.random.Generator) -> None:
    model = build_model(random_robot(rng, 5))
    q, qd, qdd = random_states(rng, 10, 5)
    torque = rigid_body_torque(model, q, qd, qdd)
    data = mujoco.MjData(model)
    for row in range(len(q)):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[row], qd[row], torque[row]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, qdd[row], rtol=1e-7, atol=1e-7)


def energy_drift(spec: mujoco.MjSpec, step_s: float) -> tuple[float, float]:
    """How much the total energy varies in a second of free motion, and how much potential energy is exchanged [J]."""
    spec.option.timestep = step_s
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0
    energy = np.empty((round(1.0 / step_s), 2))
    for row in energy:
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)  # after mj_step alone the energy is that of an intermediate stage
        row[:] = data.energy
    return float(np.ptp(energy.sum(axis=1))), float(np.ptp(energy[:, 0]))


def test_energy_is_conserved_in_free_motion(rng: np.random.Generator) -> None:
    """What drift there is belongs to the integrator of fourth order: half the step, at most a tenth of it."""
    robot = random_robot(rng, 3)
    spec = build_spec(replace(robot, segments=tuple(replace(s, type=JointType.REVOLUTE) for s in robot.segments)))
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    drift, exchanged = energy_drift(spec, 1e-3)
    finer_drift, _ = energy_drift(spec, 5e-4)
    assert exchanged > 1.0
    assert drift < 1e-8 * exchanged
    assert finer_drift < 0.1 * drift


def test_turned_gravity_is_the_robot_files(rng: np.random.Generator) -> None:
    link = LinkInertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.1, 0.4, 0.4]))
    rest = np.zeros((1, 1))
    torque = rigid_body_torque(build_model(one_joint(link, (0.0, 3.0, 0.0))), rest, rest, rest)
    assert torque[0, 0] == pytest.approx(-1.5, abs=1e-12)


def test_flat_and_point_bodies_are_accepted(rng: np.random.Generator) -> None:
    """A flat plate meets the triangle inequality with equality, a point mass has no inertia at all.

    A robot file of ten digits may put the plate, or the smallest moment, a hair outside.
    """
    for moments in ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3 + 1e-10], [0.0, 0.3, 0.3 + 1e-10], [-1e-10, 0.3, 0.3], [0.0] * 3):
        robot = one_joint(LinkInertia(1.0, np.zeros(3), np.diag(moments)), (0.0, 0.0, -9.81))
        q, qd, qdd = random_states(rng, 5, 1)
        np.testing.assert_allclose(
            rigid_body_torque(build_model(robot), q, qd, qdd), moments[2] * qdd, rtol=1e-10, atol=1e-10
        )


@pytest.mark.parametrize(
    "link",
    [
        LinkInertia(-1.0, np.zeros(3), np.eye(3)),
        LinkInertia(0.0, np.ones(3), np.eye(3)),
        LinkInertia(1.0, np.array([1.0, 0.0, 0.0]), 0.5 * np.eye(3)),
        LinkInertia(1.0, np.zeros(3), np.diag([1.0, 1.0, 2.1])),
    ],
)
def test_an_impossible_body_is_simulated_as_the_nearest_one(link: LinkInertia, rng: np.random.Generator) -> None:
    q, qd, qdd = random_states(rng, 5, 1)
    stated, nearest = (
        rigid_body_torque(build_model(one_joint(each, (0.0, -9.81, 0.0))), q, qd, qdd)
        for each in (link, nearest_body(link))
    )
    np.testing.assert_array_equal(stated, nearest)


def test_missing_links_are_named() -> None:
    with pytest.raises(RobotFileError, match=r"one: model.links states 0 of 1 links"):
        build_model(arm("one", [dh_segment(0.0, 0.0, 0.0, 0.0)]))


def test_what_mujoco_refuses_is_one_line() -> None:
    """Two joints of one name are not ours to judge; MuJoCo's reason is passed on."""
    link = LinkInertia(1.0, np.zeros(3), np.eye(3))
    robot = with_links(arm("twice", [dh_segment(0.0, 0.0, 0.0, 0.0)] * 2), link, link)
    robot = replace(robot, joints=(robot.joints[0], robot.joints[0]))
    with pytest.raises(RobotFileError, match=r"twice: MuJoCo refuses the arm \(repeated name 'joint1'") as caught:
        build_model(robot)
    assert "\n" not in str(caught.value)
