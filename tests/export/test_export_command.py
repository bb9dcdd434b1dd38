"""``tauscope export``: a model file to every format, and back through other readers to 1e-9."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from cli.conftest import Ended
from tauscope.dynamics import inverse_dynamics
from tauscope.export.model_file import read_export_model
from tauscope.robot import Robot, read_robot
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import simulate_recording, write_recording_csv

Run = Callable[..., Ended]


def link(name: str, mass: float, x: float) -> str:
    inertia = '<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.05"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/><origin xyz="{x} 0 0.05"/>{inertia}</inertial></link>'


def joint(name: str, kind: str, parent: str, child: str, x: float, rest: str) -> str:
    limit = '<limit lower="-2" upper="2" effort="60" velocity="3"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0.1"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{limit}{rest}</joint>'


URDF = "".join(
    [
        '<robot name="palletiser"><link name="base"/>',
        link("column", 4, 0.1) + link("arm", 3, 0.2) + link("hand", 1, 0.05) + link("finger", 0.2, 0.01),
        joint("turn", "revolute", "base", "column", 0, '<axis xyz="0 0 1"/>'),
        joint("lift", "revolute", "column", "arm", 0.1, '<axis xyz="0 1 0"/>'),
        joint("level", "revolute", "arm", "hand", 0.4, '<axis xyz="0 1 0"/><mimic joint="lift" multiplier="-1"/>'),
        joint("grip", "prismatic", "hand", "finger", 0.1, '<axis xyz="0 1 0"/>'),
        "</robot>",
    ]
)
ROBOT = """
name: palletiser
kinematics: {urdf: {file: arm.urdf, base: base, tip: hand}}
locked: {grip: 0.03}
joints:
  - {name: lift, friction_shape: {k_v: 200, delta: 10}}
  - {name: turn, friction_shape: {k_v: 200, delta: 10}}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot file with its URDF, a recording of it, and the model that identify made."""
    path = tmp_path_factory.mktemp("export")
    (path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (path / "arm.yaml").write_text(ROBOT, encoding="utf-8")
    arm = read_robot(path / "arm.yaml")
    motion = random_fourier_motion(arm.joints, np.random.default_rng(1), period_s=5.0)
    rng = np.random.default_rng(2)
    recording = simulate_recording(arm, motion, rate_hz=100.0, periods=2, noise_std=0.01, rng=rng)
    write_recording_csv(path / "run.csv", recording, arm.joints)
    return path


@pytest.fixture
def model(folder: Path, run: Run) -> Path:
    path = folder / "model.json"
    if not path.exists():
        ended = run("identify", folder / "arm.yaml", folder / "run.csv", "--model", path)
        assert ended.status == 0, ended.err
    return path


def torque(robot: Robot, links: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(3)
    q, qd, qdd = (rng.normal(size=(5, robot.joint_count)) for _ in range(3))
    return inverse_dynamics(robot, links, q, qd, qdd)


def links_of(robot: Robot) -> np.ndarray:
    assert robot.model.links is not None
    return np.concatenate([each.to_vector() for each in robot.model.links])


@pytest.mark.parametrize("name", ["out.urdf", "out.xml"])
def test_simulators_file_read_again_has_the_identified_torque(folder: Path, model: Path, run: Run, name: str) -> None:
    out = folder / name
    ended = run("export", model, out)
    assert (ended.status, ended.err) == (0, "")
    given = read_export_model(model)
    expected = torque(given.robot, np.concatenate([each.to_vector() for each in given.links]))
    if name == "out.urdf":
        (folder / "again.yaml").write_text(ROBOT.replace("arm.urdf", name), encoding="utf-8")
        again = read_robot(folder / "again.yaml")
    else:
        again = read_robot(out)
    assert [each.name for each in again.joints] == ["turn", "lift"]
    assert again.link_count == 3
    np.testing.assert_allclose(torque(again, links_of(again)), expected, rtol=1e-9, atol=1e-9)
    assert again.model.friction is not None
    for found, friction in zip(again.model.friction, given.friction, strict=True):
        assert found.viscous == pytest.approx(friction.viscous, rel=1e-12)
        assert found.stiction == pytest.approx(friction.stiction + friction.stribeck, rel=1e-12)


def test_mass_of_a_gripper_stays_where_it_was(folder: Path, model: Path, run: Run) -> None:
    assert run("export", model, folder / "out.urdf").status == 0
    text = (folder / "out.urdf").read_text(encoding="utf-8")
    assert '<mass value="0.2"/>' in text
    assert "finger moves on joint grip beside the chain: it is left as it was" in text


@pytest.mark.parametrize("name", ["out.yaml", "out.json", "out.h", "out.py"])
def test_controllers_files_are_written(folder: Path, model: Path, run: Run, name: str) -> None:
    assert run("export", model, folder / name).status == 0
    assert "lift" in (folder / name).read_text(encoding="utf-8")


def test_actuators_have_gains(folder: Path, model: Path, run: Run) -> None:
    out = folder / "servo.xml"
    assert run("export", model, out, "--actuator", "position", "--kp", "400,300", "--kv", "20").status == 0
    robot = read_robot(out)
    gains = [(each.actuator.kp, each.actuator.kd) for each in robot.joints if each.actuator]
    assert gains == [(400.0, 20.0), (300.0, 20.0)]
    assert [each.limits.torque for each in robot.joints] == [60.0, 60.0]


def test_isaac_lab_gets_friction_as_torque(
    folder: Path,
    model: Path,
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = folder / "actuators.py"
    assert run("export", model, out, "--isaac-lab", "--kp", "400").status == 0
    module = ModuleType("isaaclab.actuators")
    module.ImplicitActuatorCfg = dict  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "isaaclab", ModuleType("isaaclab"))
    monkeypatch.setitem(sys.modules, "isaaclab.actuators", module)
    space: dict[str, Any] = {}
    exec(out.read_text(encoding="utf-8"), space)
    arm, given = space["PALLETISER_ACTUATORS"]["arm"], read_export_model(model)
    assert arm["joint_names_expr"] == ["turn", "lift"]
    assert arm["stiffness"] == {"turn": 400.0, "lift": 400.0}
    assert arm["effort_limit"] == {"turn": 60.0, "lift": 60.0}
    for name, friction in zip(("turn", "lift"), given.friction, strict=True):
        assert arm["viscous_friction"][name] == friction.viscous
        assert arm["friction"][name] >= arm["dynamic_friction"][name]


def test_model_can_be_compared_with(folder: Path, model: Path, run: Run) -> None:
    document = json.loads(model.read_text(encoding="utf-8"))
    assert document["schema"] == "tauscope.model/1"
    assert document["arm"]["segments"] == ["turn", "lift", "level"]
    assert [each["name"].endswith("run.csv") if isinstance(each, dict) else each[0].endswith("run.csv")
            for each in document["arm"]["recordings"]] == [True]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("out.txt",), "the suffix names no format; use .json"),
        (("out.urdf", "--actuator", "position"), "only an MJCF"),
        (("out.xml", "--kp", "much"), "must be numbers"),
        (("out.xml", "--isaac-lab"), "Isaac Lab reads Python"),
        (("model.json",), "is an input of this command"),
    ],
)
def test_wrong_usage_is_refused(folder: Path, model: Path, run: Run, words: tuple[str, ...], message: str) -> None:
    ended = run("export", model, folder / words[0], *words[1:])
    assert ended.status == 2
    assert message in " ".join(ended.err.split())


def test_file_without_its_arm_is_refused_with_a_remedy(folder: Path, model: Path, run: Run) -> None:
    document = json.loads(model.read_text(encoding="utf-8"))
    del document["arm"]
    old = folder / "old.json"
    old.write_text(json.dumps(document), encoding="utf-8")
    ended = run("export", old, folder / "out.xml")
    assert (ended.status, ended.out) == (1, "")
    assert "write it again with --model" in ended.err


def test_joint_that_follows_before_its_master_keeps_its_place(folder: Path, run: Run) -> None:
    """The first segment follows; friction, limits and the actuator belong to the master behind it."""
    text = URDF.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><mimic joint="lift" multiplier="0.5" offset="0.1"/>')
    (folder / "early.urdf").write_text(text, encoding="utf-8")
    (folder / "early.yaml").write_text(
        ROBOT.replace("arm.urdf", "early.urdf").replace(
            "  - {name: turn, friction_shape: {k_v: 200, delta: 10}}\n", ""
        ),
        encoding="utf-8",
    )
    arm = read_robot(folder / "early.yaml")
    assert ([joint.name for joint in arm.joints], arm.own_links, arm.first_links) == (["lift"], (1,), (0,))
    motion = random_fourier_motion(arm.joints, np.random.default_rng(1), period_s=5.0)
    rng = np.random.default_rng(2)
    recording = simulate_recording(arm, motion, rate_hz=100.0, periods=2, noise_std=0.01, rng=rng)
    write_recording_csv(folder / "early.csv", recording, arm.joints)
    model, out = folder / "early.json", folder / "early.xml"
    assert run("identify", folder / "early.yaml", folder / "early.csv", "--model", model).status == 0
    assert run("export", model, out).status == 0
    given, again = read_export_model(model), read_robot(out)
    assert [joint.name for joint in again.joints] == ["lift"]
    assert again.joints[0].limits.position == (-2.0, 2.0)
    expected = torque(given.robot, np.concatenate([each.to_vector() for each in given.links]))
    np.testing.assert_allclose(torque(again, links_of(again)), expected, rtol=1e-9, atol=1e-9)


def test_own_mjcf_takes_the_values(folder: Path, model: Path, run: Run) -> None:
    """Only a model of that MJCF is written onto it."""
    own = folder / "own.xml"
    assert run("export", model, own).status == 0
    ended = run("export", model, folder / "new.xml", "--onto", own)
    assert ended.status == 1
    assert "the model comes from another file than an MJCF" in ended.err
    made = folder / "own.json"
    assert run("identify", own, folder / "run.csv", "--model", made).status == 0
    assert run("export", made, folder / "new.xml", "--onto", own).status == 0
    given, again = read_export_model(made), read_robot(folder / "new.xml")
    expected = torque(given.robot, np.concatenate([each.to_vector() for each in given.links]))
    np.testing.assert_allclose(torque(again, links_of(again)), expected, rtol=1e-9, atol=1e-9)
