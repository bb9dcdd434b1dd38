"""The user's own MJCF with the identified values: read again to 1e-9, all else byte for byte."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from export.exported import ORIGIN, model_of
from sim_backend.test_mjcf_chain import ARM, random_states, tauscope_torque, write_robot
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.periodic_torque import Cogging
from tauscope.errors import ExportError
from tauscope.export.compensation.model import JointFriction
from tauscope.export.mjcf_patch import patch_mjcf
from tauscope.export.model import ExportModel, FoundEffect
from tauscope.robot import LinkInertia, read_robot

# pyright: reportAttributeAccessIssue=false

FRICTIONS = [JointFriction(1.0 + joint, -0.2, 0.3 + joint, 0.0, 300.0, 10.0) for joint in range(3)]


def identified(path: Path, effects: tuple[FoundEffect, ...] = ()) -> ExportModel:
    """The arm with a tenth more mass everywhere."""
    robot = read_robot(path)
    assert robot.model.links is not None
    links = [LinkInertia.from_vector(1.1 * link.to_vector()) for link in robot.model.links]
    return model_of(robot, links, FRICTIONS, (0.05, None, 0.02), effects, replace(ORIGIN, is_mjcf=True))


def test_patched_file_has_the_identified_torque(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ARM)
    given = identified(path)
    patched = patch_mjcf(tmp_path / "arm.xml", given)
    (tmp_path / "arm.xml").write_bytes(patched)
    again = read_robot(path)
    states = random_states(again, 5)
    expected = tauscope_torque(
        replace(given.robot, model=replace(given.robot.model, links=given.links, friction=None, rotor_inertia=None)),
        *states,
    )
    expected += states[1] * [friction.viscous for friction in FRICTIONS] + states[2] * [0.05, 0.0, 0.02]
    np.testing.assert_allclose(tauscope_torque(again, *states), expected, rtol=1e-9, atol=1e-9)
    assert again.model.friction is not None
    assert [friction.stiction for friction in again.model.friction] == pytest.approx([0.8, 1.8, 2.8])
    text = patched.decode()
    for kept in ('file="missing.stl"/>', '<include file="part.xml"/>', 'euler="10 20 5"', 'kp="100"'):
        assert kept in text


def test_findings_are_added_in_the_files_own_angle_unit(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ARM)
    wave = FoundEffect(Cogging(1), np.array([0.3, 0.4]), np.array([8.0]))
    spring = FoundEffect(JointSpring(0), np.array([5.0]), np.zeros(0))
    given = identified(path, (wave, spring))
    first = replace(FRICTIONS[0], offset=1.0)
    given = replace(given, friction=(first, *FRICTIONS[1:]))
    text = patch_mjcf(tmp_path / "arm.xml", given).decode()
    (tmp_path / "arm.xml").write_text(text, encoding="utf-8")
    with pytest.raises(ExportError, match="holds findings of an earlier export; give the file as it was before"):
        patch_mjcf(tmp_path / "arm.xml", given)
    text = text.replace('<geom type="mesh" mesh="missing"/>', "")
    text = text.replace('<mesh name="missing" file="missing.stl"/>', "")
    part = (tmp_path / "part.xml").read_bytes()
    model = mujoco.MjModel.from_xml_string(text, {"part.xml": part})
    assert (model.nu, model.jnt_stiffness[0], model.qpos_spring[0]) == (2, 5.0, pytest.approx(-0.2))
    assert "cogging@elbow (tau = sum a sin(k q + phi)) is included" in text


def test_patching_twice_is_patching_once(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ARM)
    given = identified(path)
    once = patch_mjcf(tmp_path / "arm.xml", given)
    (tmp_path / "arm.xml").write_bytes(once)
    assert patch_mjcf(tmp_path / "arm.xml", given) == once


def test_model_of_another_file_is_refused(tmp_path: Path) -> None:
    given = identified(write_robot(tmp_path, ARM))
    with pytest.raises(ExportError, match="the model comes from another file than an MJCF; give this MJCF as ROBOT"):
        patch_mjcf(tmp_path / "arm.xml", replace(given, origin=ORIGIN))
    (tmp_path / "arm.xml").write_text(ARM.replace('name="elbow"', 'name="elbow2"'), encoding="utf-8")
    with pytest.raises(ExportError, match=r"joint 'elbow' is not in the file itself; did you mean 'elbow2'\?"):
        patch_mjcf(tmp_path / "arm.xml", given)
