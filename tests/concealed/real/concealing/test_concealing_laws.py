"""Concealing laws beside closed forms and Pinocchio."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest

from concealed.generator.arms import arm_named
from concealed.real.concealing import channels, joint_laws, robot_file
from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.joint_laws import bristle_force
from concealed.real.concealing.kinds import KINDS
from concealed.real.concealing.made_up_set import made_up_set, pinocchio_torque
from concealed.real.concealing.passage import Passage
from concealed.real.concealing.tip import mass_torque, tip_torque
from pinocchio_arm import pinocchio_model
from tauscope.robot import Model, read_robot
from tauscope.robot.robot import LinkInertia

FRICTION = (
    "load_friction",
    "asymmetric_coulomb",
    "asymmetric_viscous",
    "nonlinear_viscous",
    "position_friction",
    "drift",
)


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Ground:
    return made_up_set(tmp_path_factory.mktemp("made-up"))


def draw(ground: Ground, kind: str, joint: int = 1, seed: int = 0) -> Concealment:
    drawn = KINDS[kind](ground, joint, np.random.default_rng(seed))
    assert drawn is not None
    return drawn


def unit(ground: Ground, concealment: Concealment) -> tuple[Passage, np.ndarray, np.ndarray]:
    passage, load = ground.passages[0], ground.load[0]
    assert concealment.torque is not None
    return passage, load, concealment.torque(passage, load)


@pytest.mark.parametrize("arm", ["paper", "six", "linear"])
def test_a_force_at_the_tip_is_held_by_the_jacobian_transposed(arm: str) -> None:
    robot, rng = arm_named(arm), np.random.default_rng(3)
    position, force = rng.normal(size=(4, robot.joint_count)), np.array([2.0, -5.0, 3.0])
    model = pinocchio_model(robot)
    last = robot.segments[-1].after
    placement = pinocchio.SE3(last.rotation, last.translation)
    tip = model.addFrame(pinocchio.Frame("tip", robot.joint_count, 0, placement, pinocchio.OP_FRAME))
    data = model.createData()
    expected = [
        pinocchio.computeFrameJacobian(model, data, q, tip, pinocchio.LOCAL_WORLD_ALIGNED)[:3].T @ force
        for q in position
    ]
    np.testing.assert_allclose(tip_torque(robot, position, force), expected, atol=1e-12)


@pytest.mark.parametrize("arm", ["seven", "six", "linear"])
def test_a_mass_has_the_torque_that_pinocchio_gives_a_heavier_link(arm: str) -> None:
    robot, rng = arm_named(arm), np.random.default_rng(4)
    q, qd, qdd = (rng.normal(size=(4, robot.joint_count)) for _ in range(3))
    mass, place = 1.7, np.array([0.05, -0.02, 0.11])
    links = list(robot.model.links or ())
    cross = np.cross(np.eye(3), place)
    point = LinkInertia(mass, mass * place, mass * cross.T @ cross)
    heavier = LinkInertia.from_vector(links[-1].to_vector() + point.to_vector())
    loaded = replace(robot, model=Model((*links[:-1], heavier), None))
    expected = pinocchio_torque(loaded, q, qd, qdd) - pinocchio_torque(robot, q, qd, qdd)
    np.testing.assert_allclose(mass * mass_torque(robot, q, qd, qdd, place), expected, atol=1e-10)


def test_a_spring_pulls_to_the_middle_of_the_range(ground: Ground) -> None:
    concealment = draw(ground, "spring")
    passage, _, torque = unit(ground, concealment)
    middle = 0.5 * (ground.low[1] + ground.high[1])
    np.testing.assert_allclose(torque[:, 1], concealment.constants["side"] * (passage.position[:, 1] - middle))
    assert not np.delete(torque, 1, axis=1).any()


@pytest.mark.parametrize("seed", range(4))
def test_a_cable_pulls_back_beyond_its_angle_alone(ground: Ground, seed: int) -> None:
    concealment = draw(ground, "cable", seed=seed)
    passage, _, torque = unit(ground, concealment)
    told, side = concealment.parameters(1.0), concealment.constants["side"]
    stretch = side * (passage.position[:, 1] - told["q_t"])
    assert not torque[stretch <= 0.0].any()
    np.testing.assert_allclose(torque[stretch > 0.0, 1], side * stretch[stretch > 0.0] ** told["p"])


def test_waves_repeat_with_an_angle_that_range_and_band_hold(ground: Ground) -> None:
    cogging, ripple = draw(ground, "cogging"), draw(ground, "ripple")
    passage, load, torque = unit(ground, cogging)
    order = cogging.parameters(1.0)["order"]
    assert order * ground.reach[1] >= 4.0 * np.pi - 1e-9
    assert order * ground.fastest[1] <= 2.0 * np.pi * ground.band_hz
    np.testing.assert_allclose(torque[:, 1], np.sin(order * passage.position[:, 1] + cogging.constants["phase"]))
    wave = np.sin(ripple.parameters(1.0)["order"] * passage.position[:, 1] + ripple.constants["phase"])
    np.testing.assert_allclose(unit(ground, ripple)[2][:, 1], load[:, 1] * wave)


@pytest.mark.parametrize("ratio", [4.0, 100.0])
def test_a_stated_gear_ratio_allows_whole_turns_of_the_motor(ground: Ground, ratio: float) -> None:
    joints = tuple(replace(joint, gear_ratio=ratio) for joint in ground.robot.joints)
    geared = replace(ground, robot=replace(ground.robot, joints=joints))
    drawn = KINDS["cogging"](geared, 1, np.random.default_rng(0))
    if ratio == 100.0:  # more than 8 Hz at the speed of this joint
        assert drawn is None
    else:
        assert drawn is not None
        assert drawn.parameters(1.0)["order"] % ratio == 0.0


@pytest.mark.parametrize("kind", FRICTION)
@pytest.mark.parametrize("seed", range(3))
def test_friction_that_is_added_dissipates_at_every_instant(ground: Ground, kind: str, seed: int) -> None:
    passage, _, torque = unit(ground, draw(ground, kind, seed=seed))
    power = torque[:, 1] * passage.velocity[:, 1]
    assert power.min() >= -1e-12
    assert power.max() > 0.0


def test_coupled_friction_is_the_friction_of_one_motor_that_turns_with_two_joints(ground: Ground) -> None:
    concealment = draw(ground, "coupling")
    passage, _, torque = unit(ground, concealment)
    side = concealment.constants["side"]
    np.testing.assert_allclose(torque[:, 2], side * torque[:, 1])
    common = passage.velocity[:, 1] + side * passage.velocity[:, 2]
    fast = np.abs(common) > 1.0
    np.testing.assert_allclose(torque[fast, 1], np.sign(common[fast]), atol=1e-3)


def test_load_friction_goes_with_the_load(ground: Ground) -> None:
    passage, load, torque = unit(ground, draw(ground, "load_friction"))
    fast = np.abs(passage.velocity[:, 1]) > 0.5
    expected = np.abs(load[fast, 1]) * np.sign(passage.velocity[fast, 1])
    np.testing.assert_allclose(torque[fast, 1], expected, rtol=2e-3)


def test_a_bristle_bends_over_its_length_after_a_reversal() -> None:
    there = np.linspace(0.0, 0.5, 501)
    back = np.linspace(0.499, 0.3, 200)
    position = np.concatenate([there, back])
    velocity = np.gradient(position)
    length = 0.01
    force = bristle_force(position, velocity, length, None)
    np.testing.assert_allclose(force[500], 1.0, atol=1e-9)
    travelled = 0.5 - back
    np.testing.assert_allclose(force[501:], -1.0 + 2.0 * np.exp(-travelled / length), atol=1e-9)
    slow = bristle_force(there, np.full(501, 1e-4), length, 1.0)
    np.testing.assert_allclose(slow[-1], 1.3, rtol=1e-6)


def test_drift_is_gone_after_its_time(ground: Ground) -> None:
    concealment = draw(ground, "drift")
    passage, _, torque = unit(ground, concealment)
    constant = concealment.parameters(1.0)["T"]
    expected = np.exp(-passage.time / constant) * joint_laws.soft_sign(passage.velocity[:, 1], 0.02 * ground.speed[1])
    np.testing.assert_allclose(torque[:, 1], expected)
    # The catalogue's f is what friction has changed by at the end of the longest recording.
    assert concealment.parameters(2.0)["f"] == pytest.approx(2.0 * np.expm1(-passage.time[-1] / constant))


def test_a_delayed_sine_is_the_sine_of_before() -> None:
    time = np.arange(2000) / 200.0
    torque = np.column_stack([np.sin(3.0 * time), np.cos(2.0 * time)])
    late = channels.delay_torque(time, torque, [0], 0.0137)
    np.testing.assert_allclose(late[10:, 0], np.sin(3.0 * (time[10:] - 0.0137)), atol=1e-7)
    np.testing.assert_array_equal(late[:, 1], torque[:, 1])
    early = channels.delay_torque(time, torque, [0], -0.0137)
    np.testing.assert_allclose(early[:-10, 0], np.sin(3.0 * (time[:-10] + 0.0137)), atol=1e-7)


def test_a_gain_is_a_factor_and_a_limit_cuts_both_ways() -> None:
    torque = np.array([[2.0, -3.0], [-5.0, 1.0]])
    np.testing.assert_allclose(channels.scale_torque(torque, [0], -2.0), [[-2.0, -3.0], [5.0, 1.0]])
    np.testing.assert_allclose(channels.clip_torque(torque, 0, 3.0), [[2.0, -3.0], [-3.0, 1.0]])


def test_gravity_is_turned_by_the_angle_and_keeps_its_length(ground: Ground, tmp_path: Path) -> None:
    concealment = draw(ground, "gravity")
    assert concealment.rewrite is not None
    concealment.rewrite(0.4, ground.folder, tmp_path)
    turned, down = read_robot(tmp_path / "robot.yaml").gravity, ground.robot.gravity
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(down))
    assert np.arccos(turned @ down / (down @ down)) == pytest.approx(0.4)
    concealment.rewrite(-0.4, tmp_path, tmp_path / "back")
    np.testing.assert_allclose(read_robot(tmp_path / "back" / "robot.yaml").gravity, down, atol=1e-7)


def test_one_length_of_the_robot_file_is_wrong_by_the_size(ground: Ground, tmp_path: Path) -> None:
    concealment = draw(ground, "link_length", joint=2)
    assert concealment.rewrite is not None
    concealment.rewrite(0.02, ground.folder, tmp_path)
    pairs = zip(ground.robot.segments, read_robot(tmp_path / "robot.yaml").segments, strict=True)
    moved = [
        getattr(wrong, side).translation - getattr(right, side).translation
        for right, wrong in pairs
        for side in ("before", "after")
    ]
    sizes = [float(np.linalg.norm(each)) for each in moved]
    assert sorted(sizes)[-1] == pytest.approx(0.02)
    assert sorted(sizes)[-2] == pytest.approx(0.0)


def test_a_length_of_a_urdf_is_wrong_by_the_size(tmp_path: Path) -> None:
    text = '<robot name="r"><joint name="b" type="revolute"><origin xyz="0.1 0 -0.4" rpy="0 0 0"/></joint></robot>'
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "robot.yaml").write_text("kinematics: {urdf: {file: arm.urdf}}\njoints: [{name: a}, {name: b}]\n")
    robot_file.lengthen_link(tmp_path, tmp_path / "wrong", ("urdf", 1, "xyz"), 0.03)
    assert 'xyz="0.1 0.0 -0.37"' in (tmp_path / "wrong" / "arm.urdf").read_text()


def test_what_a_motion_cannot_show_is_not_drawn(ground: Ground) -> None:
    still = replace(ground, high=ground.low + 1e-9)
    one_way = [each.with_torque(each.torque) for each in ground.passages]
    one_way = [replace(each, velocity=np.abs(each.velocity)) for each in one_way]
    sliding = replace(ground, passages=one_way)
    rng = np.random.default_rng(0)
    for kind in ("spring", "cable", "cogging", "ripple", "gain_joint", "delay_joint", "delay_all"):
        assert KINDS[kind](still, 1, rng) is None
    for kind in (*FRICTION, "coupling", "bristles", "sign_joint", "sign_all"):
        assert KINDS[kind](sliding, 1, rng) is None
    coarse = replace(ground, count=0.01 * ground.reach)
    assert KINDS["bristles"](coarse, 1, rng) is None


def test_the_concealing_code_has_nothing_of_the_catalogue_or_the_diagnosis() -> None:
    own = [path for path in Path(joint_laws.__file__).parent.glob("*.py") if not path.name.startswith("test_")]
    assert len(own) > 10
    for path in own:
        text = path.read_text(encoding="utf-8")
        for package in ("tauscope.effects", "tauscope.diagnosis", "tauscope.identification", "tauscope_sim"):
            assert package not in text
