"""Chains of MJCF against MuJoCo's own inverse dynamics of the whole file, to 1e-9."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.dynamics import inverse_dynamics
from tauscope.errors import MissingExtraError, RobotFileError
from tauscope.robot import Actuator, Robot, Severity, read_robot, robot_building

# pyright: reportAttributeAccessIssue=false

PART = """<mujocoinclude><default><joint damping="0.3" armature="0.02"/>
<default class="stiff"><joint frictionloss="0.4"/></default></default></mujocoinclude>"""

ARM = """<mujoco model="two links">
  <compiler angle="degree"/><option gravity="0.3 0 -9.7"/><include file="part.xml"/>
  <worldbody><body name="base" euler="20 0 30"><geom size=".1"/>
    <body name="upper" pos="0 0 .3" euler="10 20 5">
      <joint name="shoulder" axis="0 1 1" pos=".1 0 0" ref="20" range="-90 90"/>
      <geom type="capsule" size=".04" fromto="0 0 0 .3 0 0"/>
      <body name="lower" pos=".3 0 0">
        <joint name="elbow" class="stiff" axis="1 0 1"/><joint name="slide" type="slide" axis="0 0 1" ref="0.1"/>
        <geom type="box" size=".1 .05 .03" pos=".1 0 0"/>
        <body name="tool" pos=".1 .2 0"><geom type="mesh" mesh="missing"/>
          <inertial pos="0 0 .01" mass=".1" diaginertia="1e-4 1e-4 1e-4"/>
          <body name="left" pos="0 0 .1"><joint name="left" type="slide" axis="0 1 0" range="0 .04"/>
            <geom type="box" size=".01 .01 .04"/></body>
          <body name="right" pos="0 0 .1"><joint name="right" type="slide" axis="0 -1 0"/>
            <geom type="box" size=".01 .01 .04"/></body>
  </body></body></body></body></worldbody>
  <asset><mesh name="missing" file="missing.stl"/></asset>
  <equality><joint joint1="right" joint2="left"/></equality>
  <actuator>
    <position joint="shoulder" kp="100" kv="3" forcerange="-30 30"/><motor joint="elbow" gear="50" ctrlrange="-2 2"/>
  </actuator>
</mujoco>"""


def write_robot(folder: Path, text: str, rest: str = "base: base, tip: tool}}\nlocked: {left: 0.03}\n") -> Path:
    """A robot file that names an MJCF."""
    (folder / "part.xml").write_text(PART, encoding="utf-8")
    (folder / "arm.xml").write_text(text, encoding="utf-8")
    path = folder / "arm.yaml"
    path.write_text(f"name: arm\nkinematics: {{mjcf: {{file: arm.xml, {rest}", encoding="utf-8")
    return path


def tauscope_torque(robot: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Rigid bodies, damping and armature."""
    assert robot.model.links is not None
    torque = inverse_dynamics(robot, np.concatenate([link.to_vector() for link in robot.model.links]), q, qd, qdd)
    if robot.model.friction is not None:
        torque = torque + qd * [friction.viscous for friction in robot.model.friction]
    return torque + qdd * np.array(robot.model.rotor_inertia or 0.0)


def mujoco_torque(
    model: mujoco.MjModel, robot: Robot, resting: dict[str, float], states: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> np.ndarray:
    """Torque of the chain's joints while all others rest, without constraints."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data, result = mujoco.MjData(model), []
    joints = [model.joint(joint.name) for joint in robot.joints]
    for q, qd, qdd in zip(*states, strict=True):
        mujoco.mj_resetData(model, data)
        for name, value in resting.items():
            data.qpos[model.joint(name).qposadr[0]] = value
        for joint, *values in zip(joints, q, qd, qdd, strict=True):
            data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]], data.qacc[joint.dofadr[0]] = values
        mujoco.mj_inverse(model, data)
        result.append([data.qfrc_inverse[joint.dofadr[0]] for joint in joints])
    return np.array(result)


def random_states(robot: Robot, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q, qd, qdd = (rng.uniform(-1.5, 1.5, (4, robot.joint_count)) for _ in range(3))
    return q, qd, qdd


def test_includes_defaults_references_and_missing_meshes(tmp_path: Path) -> None:
    robot = read_robot(write_robot(tmp_path, ARM))
    assert [joint.name for joint in robot.joints] == ["shoulder", "elbow", "slide"]
    assert robot.mjcf == tmp_path / "arm.xml"
    assert robot.joints[0].limits.position == pytest.approx((-np.pi / 2, np.pi / 2))
    assert [joint.limits.torque for joint in robot.joints] == [30.0, 100.0, None]
    assert robot.joints[0].actuator == Actuator("position", 100.0, 3.0, scale_std=0.2)
    assert robot.model.rotor_inertia == (0.02, 0.02, 0.02)
    assert robot.model.friction is not None
    assert [(f.stiction, f.viscous) for f in robot.model.friction] == [(0.0, 0.3), (0.4, 0.3), (0.0, 0.3)]
    text = ARM.replace('<geom type="mesh" mesh="missing"/>', "").replace(
        '<mesh name="missing" file="missing.stl"/>', ""
    )
    model = mujoco.MjModel.from_xml_string(text, {"part.xml": PART.encode()})
    states = random_states(robot, 1)
    expected = mujoco_torque(model, robot, {"left": 0.03, "right": 0.03}, states)
    np.testing.assert_allclose(tauscope_torque(robot, *states), expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(robot.gravity), np.hypot(0.3, 9.7))


def random_mjcf(seed: int) -> tuple[str, str, list[str]]:
    """A tree: bodies with up to three joints, branches with joints, offsets and references; its tip and its joints."""
    rng = np.random.default_rng(seed)
    names: list[str] = []

    def numbers(size: int, scale: float = 1.0) -> str:
        return " ".join(repr(float(value)) for value in rng.uniform(-scale, scale, size))

    def joints(count: int, prefix: str) -> str:
        text = ""
        for _ in range(count):
            names.append(f"{prefix}{len(names)}")
            kind = rng.choice(["hinge", "slide"])
            text += (
                f'<joint name="{names[-1]}" type="{kind}" axis="{numbers(3)}" pos="{numbers(3, 0.2)}" '
                f'ref="{numbers(1)}" damping="{rng.uniform(0, 1)}" armature="{rng.uniform(0, 0.1)}"/>'
            )
        return text

    def body(name: str, inner: str, count: int, prefix: str) -> str:
        return (
            f'<body name="{name}" pos="{numbers(3, 0.5)}" quat="{numbers(4)}">{joints(count, prefix)}'
            f'<geom type="ellipsoid" size="{rng.uniform(0.05, 0.2)} {rng.uniform(0.05, 0.2)} 0.1" '
            f'pos="{numbers(3, 0.3)}" quat="{numbers(4)}"/>{inner}</body>'
        )

    inner = ""
    for place in range(rng.integers(2, 6), 0, -1):
        side = ""
        if rng.uniform() > 0.4:
            side = body(f"side{place}", body(f"tip{place}", "", 1, "s"), int(rng.integers(0, 2)), "s")
        count = int(rng.integers(0, 4)) if place > 1 else int(rng.integers(1, 4))
        inner = body(f"main{place}", inner + side, count, "m")
    last = inner.count('name="main')
    return f"<mujoco><worldbody>{inner}</worldbody></mujoco>", f"main{last}", names


@given(seed=st.integers(0, 2**32 - 1))
def test_random_tree_has_mujocos_torque(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    text, tip, names = random_mjcf(seed)
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(text.replace("<mujoco>", '<mujoco><compiler angle="radian"/>'))
    locked = {name: float(rng.uniform(-1, 1)) for name in names if name.startswith("s") and rng.uniform() > 0.5}
    stated = ", ".join(f"{name}: {value!r}" for name, value in locked.items())
    text = text.replace("<mujoco>", '<mujoco><compiler angle="radian"/>')
    rest = f"base: world, tip: {tip}}}}}\nlocked: {{{stated}}}\n"
    robot = read_robot(write_robot(tmp_path_factory.mktemp("mjcf"), text, rest))
    assert {joint.name for joint in robot.joints} == {name for name in names if name.startswith("m")}
    states = random_states(robot, seed)
    expected = mujoco_torque(model, robot, locked, states)
    np.testing.assert_allclose(tauscope_torque(robot, *states), expected, rtol=1e-9, atol=1e-9)


def test_bare_mjcf_runs_to_the_deepest_body_below_a_free_joint(tmp_path: Path) -> None:
    path = tmp_path / "drone.xml"
    text = """<mujoco model="d"><worldbody><body name="trunk"><freejoint/><geom size=".1"/>
      <body name="arm"><joint name="a" axis="0 1 0"/><geom size=".1" pos=".1 0 0"/></body></body>
      </worldbody></mujoco>"""
    path.write_text(text, encoding="utf-8")
    robot = read_robot(path)
    assert [joint.name for joint in robot.joints] == ["a"]
    assert [note.code for note in robot.warnings] == ["default-chain"]
    assert "from 'trunk' to the deepest leaf 'arm'" in robot.warnings[0].text


def test_joint_that_follows_by_equality_has_no_coordinate_of_its_own(tmp_path: Path) -> None:
    text = """<mujoco><compiler angle="radian"/><worldbody><body name="a"><joint name="one" axis="0 1 0"/>
      <geom size=".1" pos=".2 0 0"/><body name="b" pos=".4 0 0"><joint name="two" axis="0 1 0"/>
      <geom size=".1" pos=".2 .1 0"/></body></body></worldbody>
      <equality><joint joint1="two" joint2="one" polycoef="0.2 -1 0 0 0"/></equality></mujoco>"""
    robot = read_robot(write_robot(tmp_path, text, "base: world, tip: b}}\n"))
    assert [joint.name for joint in robot.joints] == ["one"]
    q, qd, qdd = random_states(robot, 2)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    expected = []
    for one, velocity, acceleration in zip(q[:, 0], qd[:, 0], qdd[:, 0], strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = (
            [one, 0.2 - one],
            [velocity, -velocity],
            [acceleration, -acceleration],
        )
        mujoco.mj_inverse(model, data)
        expected.append(data.qfrc_inverse[0] - data.qfrc_inverse[1])
    np.testing.assert_allclose(tauscope_torque(robot, q, qd, qdd)[:, 0], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<option gravity="0.3 0 -9.7"/>', '<option density="1000"/>', "leaves out drag of the medium"),
        ('<body name="lower"', '<body name="lower" gravcomp="1"', "leaves out gravity compensation"),
        ('<joint name="elbow"', '<joint name="elbow" stiffness="3"', "has stiffness 3, which the model leaves out"),
        ('<joint name="elbow"', '<joint name="elbow" damping="1 2 3"', "has polynomial damping"),
    ],
)
def test_forces_that_the_model_leaves_out_are_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    robot = read_robot(write_robot(tmp_path, ARM.replace(old, new)))
    assert [words in finding.text for finding in robot.findings if finding.severity is Severity.WARNING] == [True]


def test_gravity_that_is_switched_off_is_none(tmp_path: Path) -> None:
    option = '<option gravity="0.3 0 -9.7"><flag gravity="disable"/></option>'
    robot = read_robot(write_robot(tmp_path, ARM.replace('<option gravity="0.3 0 -9.7"/>', option)))
    np.testing.assert_array_equal(robot.gravity, np.zeros(3))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name="elbow" class="stiff"', 'name="elbow" class="stif"', "MuJoCo refuses the file .*stif"),
        ("<worldbody>", "<worldbdy>", r"arm\.xml:\d+: not valid XML|MuJoCo refuses the file"),
        ('<joint name="shoulder" axis="0 1 1" pos=".1 0 0" ref="20" range="-90 90"/>', '<joint name="s" type="ball"/>',
         "joint 's' is a ball or free joint; name the body beyond it as base"),
    ],
)  # fmt: skip
def test_what_is_no_arm_is_refused_in_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = ARM.replace('<position joint="shoulder" kp="100" kv="3" forcerange="-30 30"/>', "")
    with pytest.raises(RobotFileError, match=message) as caught:
        read_robot(write_robot(tmp_path, text.replace(old, new)))
    assert "\n" not in str(caught.value)


def test_a_scene_without_an_arm_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text('<mujoco><worldbody><geom size="1 1 1" type="plane"/></worldbody></mujoco>', encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"no hinge or slide lies between .*; give the file of the whole arm$"):
        read_robot(path)


def test_mesh_that_gives_a_mass_must_be_there(tmp_path: Path) -> None:
    text = ARM.replace('<inertial pos="0 0 .01" mass=".1" diaginertia="1e-4 1e-4 1e-4"/>', "")
    with pytest.raises(RobotFileError, match=r"missing\.stl.*; put that file there, or state <inertial> of every body"):
        read_robot(write_robot(tmp_path, text))


def test_extra_that_is_missing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Entry:
        def load(self) -> None:
            raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")

    path = write_robot(tmp_path, ARM)
    monkeypatch.setattr(robot_building, "entry_points", lambda group: [Entry()])
    with pytest.raises(MissingExtraError, match=r"arm\.xml: reading an MJCF needs the sim extra: pip install"):
        read_robot(path)


def test_body_that_is_not_there_is_refused_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match=r"the tip body 'toll' is not in the file; did you mean 'tool'\?"):
        read_robot(write_robot(tmp_path, ARM, "base: base, tip: toll}}\n"))
