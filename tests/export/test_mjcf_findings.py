"""Findings and actuators in an exported MJCF: MuJoCo's torque against the findings' own equations, to 1e-9."""

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from export.exported import friction, mjcf_of, model_of
from export.test_simulator_files import ellipsoid, random_arm
from tauscope.dynamics import inverse_dynamics
from tauscope.effects import Effect
from tauscope.effects.base_tilt import BaseTilt, tilt_directions
from tauscope.effects.carried_body import unit_body
from tauscope.effects.friction_coupling import FrictionCoupling
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.kinematic_error import KinematicError, displaced
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.effects.nonlinear_viscous import NonlinearViscous
from tauscope.effects.payload import Payload
from tauscope.effects.periodic_torque import Cogging
from tauscope.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope.errors import ExportError
from tauscope.export.actuators import ActuatorChoice, ActuatorKind
from tauscope.export.compensation.model import JointFriction
from tauscope.export.formats import ExportFormat, make_export
from tauscope.export.model import FoundEffect
from tauscope.robot import Robot

# pyright: reportAttributeAccessIssue=false

Array = np.ndarray
COUNT = 3


def found(effect: Effect, coefficients: list[float], shape: list[float] | None = None) -> FoundEffect:
    return FoundEffect(effect, np.array(coefficients), np.array(shape or []))


def drive_torque(text: str, q: Array, qd: Array, qdd: Array) -> Array:
    """What the drives must give for a motion, without dry friction: MuJoCo's inverse less what passive motors give."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, torques = mujoco.MjData(model), []
    for position, velocity, acceleration in zip(q, qd, qdd, strict=True):
        data.qpos[:], data.qvel[:] = position, velocity
        mujoco.mj_forward(model, data)
        passive = np.array(data.qfrc_actuator)
        data.qacc[:] = acceleration
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse - passive)
    return np.array(torques)


def rigid(robot: Robot, links: list[Array], q: Array, qd: Array, qdd: Array, frictions: list[JointFriction]) -> Array:
    torque = inverse_dynamics(robot, np.concatenate(links), q, qd, qdd)
    return torque + qd * [each.viscous for each in frictions]


Law = Callable[[Array, Array], Array]
JOINT_LAWS: dict[str, tuple[FoundEffect, int, Law]] = {
    "spring": (found(JointSpring(1), [4.0]), 1, lambda q, v: 4.0 * q + 0.05),
    "square": (found(NonlinearViscous(2), [0.7], [2.0]), 2, lambda q, v: 0.7 * v * np.abs(v)),
    "cube": (found(NonlinearViscous(0), [0.4], [3.0]), 0, lambda q, v: 0.4 * v**3),
    "cogging": (
        found(Cogging(1), [0.3, -0.2], [7.3]),
        1,
        lambda q, v: 0.3 * np.sin(7.3 * q) - 0.2 * np.cos(7.3 * q),
    ),
}


@pytest.mark.parametrize("name", JOINT_LAWS)
def test_finding_at_a_joint_has_its_torque_in_mujoco(name: str) -> None:
    effect, joint, law = JOINT_LAWS[name]
    rng = np.random.default_rng(3)
    robot, links = random_arm(rng, COUNT), [ellipsoid(rng) for _ in range(COUNT)]
    frictions = [friction(rng) for _ in range(COUNT)]
    q, qd, qdd = (rng.normal(size=(6, COUNT)) for _ in range(3))
    written = mjcf_of(robot, links, frictions, effects=[effect])
    expected = rigid(robot, [link.to_vector() for link in links], q, qd, qdd, frictions)
    expected[:, joint] += law(q[:, joint], qd[:, joint])
    np.testing.assert_allclose(drive_torque(written.text, q, qd, qdd), expected, rtol=1e-9, atol=1e-9)
    assert any("is included" in note for note in written.notes)


def test_findings_of_the_whole_arm_have_their_torque_in_mujoco() -> None:
    rng = np.random.default_rng(4)
    robot, links = random_arm(rng, COUNT), [ellipsoid(rng) for _ in range(COUNT)]
    frictions = [friction(rng) for _ in range(COUNT)]
    q, qd, qdd = (rng.normal(size=(6, COUNT)) for _ in range(3))
    place = np.array([0.1, -0.05, 0.2])
    effects = [
        found(Payload(None), [0.8], place.tolist()),
        found(BaseTilt(None), [0.02, -0.03]),
        found(KinematicError(None), [0.004], [2.0, 1.0]),
    ]
    strength, across = np.linalg.norm(robot.gravity), tilt_directions(robot.gravity)
    arm = displaced(robot, 1, np.array([0.004, 0.0, 0.0]))
    object.__setattr__(arm, "gravity", robot.gravity + strength * (0.02 * across[0] - 0.03 * across[1]))
    vectors = [link.to_vector() for link in links]
    vectors[-1] = vectors[-1] + 0.8 * unit_body(place)
    written = mjcf_of(robot, links, frictions, effects=effects)
    expected = rigid(arm, vectors, q, qd, qdd, frictions)
    np.testing.assert_allclose(drive_torque(written.text, q, qd, qdd), expected, rtol=1e-9, atol=1e-9)


def test_coupled_friction_is_a_tendon() -> None:
    rng = np.random.default_rng(5)
    robot, links = random_arm(rng, COUNT), [ellipsoid(rng) for _ in range(COUNT)]
    frictions = [friction(rng) for _ in range(COUNT)]
    q, qd, qdd = (rng.normal(size=(6, COUNT)) for _ in range(3))
    written = mjcf_of(
        robot, links, frictions, effects=[found(FrictionCoupling(2, partner=1, sign=-1), [0.5, 0.6], [9.0])]
    )
    expected = rigid(robot, [link.to_vector() for link in links], q, qd, qdd, frictions)
    common = 0.6 * (qd[:, 2] - qd[:, 1])
    expected[:, 2] += common
    expected[:, 1] -= common
    np.testing.assert_allclose(drive_torque(written.text, q, qd, qdd), expected, rtol=1e-9, atol=1e-9)
    assert mujoco.MjModel.from_xml_string(written.text).tendon_frictionloss == pytest.approx([0.5])


def test_bristles_rise_over_their_length_and_take_the_place_of_dry_friction() -> None:
    rng = np.random.default_rng(6)
    robot, frictions = random_arm(rng, 1), [JointFriction(1.5, 0.0, 0.2, 0.0, 500.0)]
    written = mjcf_of(robot, [ellipsoid(rng)], frictions, effects=[found(PreslidingHysteresis(0), [1.2], [0.01])])
    model = mujoco.MjModel.from_xml_string(written.text)
    assert model.dof_frictionloss == pytest.approx([0.3])
    data = mujoco.MjData(model)
    data.qvel[0], data.act[0] = 0.7, 0.004  # a deflection of 4 mrad
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator[0] == pytest.approx(-1.2 * 0.4, rel=1e-12)
    assert data.act_dot[0] == pytest.approx(0.7 - 0.7 * 0.004 / 0.01, rel=1e-12)


def test_finding_that_mujoco_lacks_is_listed_with_its_numbers() -> None:
    rng = np.random.default_rng(7)
    robot = random_arm(rng, 2)
    effects = [found(LoadDependentFriction(1), [0.08]), found(NonlinearViscous(0), [0.3], [1.6])]
    given = model_of(robot, [ellipsoid(rng), ellipsoid(rng)], [friction(rng), friction(rng)], effects=effects)
    text = make_export(ExportFormat.MJCF, given).decode()
    assert "load_dependent_friction@joint2 is not included: MJCF has no such element" in text
    assert "mu = 0.08" in text
    assert "damping of second and third order, not of order 1.6" in text
    mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("kind", ActuatorKind)
def test_actuators_move_the_arm_where_they_are_sent(kind: ActuatorKind) -> None:
    rng = np.random.default_rng(8)
    robot = random_arm(rng, 2)
    frictions = [JointFriction(0.0, 0.0, 0.1, 0.0, 500.0)] * 2
    written = mjcf_of(
        robot, [ellipsoid(rng), ellipsoid(rng)], frictions, choice=ActuatorChoice(kind, (900.0,), (60.0, 70.0))
    )
    model = mujoco.MjModel.from_xml_string(written.text)
    np.testing.assert_array_equal(np.max(model.actuator_forcerange, axis=1), [40.0, 40.0])
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (0.01, -0.01), (0.02, 0.03)
    if kind is ActuatorKind.MOTOR:
        data.ctrl[:] = (3.0, -2.0)
        expected = [3.0, -2.0]
    else:
        expected = np.array([900.0, 900.0]) * -data.qpos - np.array([60.0, 70.0]) * data.qvel
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_actuator, expected, rtol=1e-9)


def test_gains_are_one_or_one_a_joint_and_said_where_they_are_chosen() -> None:
    rng = np.random.default_rng(9)
    robot, links = random_arm(rng, 3), [ellipsoid(rng) for _ in range(3)]
    frictions = [friction(rng) for _ in range(3)]
    with pytest.raises(ExportError, match="kp has 2 values; give one, or one for each of 3 joints"):
        mjcf_of(robot, links, frictions, choice=ActuatorChoice(ActuatorKind.POSITION, (1.0, 2.0)))
    written = mjcf_of(robot, links, frictions, choice=ActuatorChoice(ActuatorKind.POSITION))
    assert sum("kp is not identified" in note for note in written.notes) == 3
