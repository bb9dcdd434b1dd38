"""Exports of the identified model: the user's URDF patched in place, and MJCF, against other people's readers."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from export.exported import friction, mjcf_of
from tauscope.errors import ExportError
from tauscope.export.compensation.model import JointFriction
from tauscope.export.joint_model import JointModel
from tauscope.export.urdf import patch_urdf
from tauscope.robot import Joint, JointLimits, JointType, LinkInertia, Placement, Robot, Segment
from tauscope.robot.urdf import read_urdf_chain

DATA = Path(os.environ.get("TAUSCOPE_DATA", Path(__file__).resolve().parents[2] / "../shared/data"))

URDF = """<?xml version='1.0' encoding="utf-8"?>
<!-- made by hand -->
<robot   name="two-link"  xmlns:xacro="http://ros.org/wiki/xacro">
  <material name="grey"><color rgba="0.7 0.7 0.7 1"/></material>
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0 0"/> <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="40" velocity="2"/>
    <dynamics friction='0.1'   damping="0.2" spring_stiffness="3"/> <!-- guessed -->
  </joint>
  <link name="upper">
    <inertial> <!-- from CAD -->
      <mass value="1.0" />
      <origin rpy="0.3 0 0"
              xyz="0.1 0 0" />
      <inertia izz="0.02" ixx="0.01" iyy="0.02" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><mesh filename="package://a/upper &amp; more.stl"/></geometry></visual>
    <collision><geometry><box size="0.1 0.1 0.5"/></geometry></collision>
  </link>
  <joint name="elbow" type="continuous">
    <parent link="upper"/>
    <child link="fore"/>
    <origin xyz="0.4 0 0"/>
  </joint>
  <link name="fore" />
  <joint name="flange" type="fixed"><parent link="fore"/><child link="tool"/><origin xyz="0 0 0.2" rpy="0 0 1"/></joint>
  <link name="tool">
    <inertial><mass value="0.5"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
  </link>
  <joint name="finger" type="prismatic"><parent link="tool"/><child link="jaw"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.05" effort="1" velocity="1"/></joint>
  <link name="jaw">
    <inertial><mass value="0.05"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
  </link>
</robot>
<!-- end -->
"""


def ellipsoid(rng: np.random.Generator) -> LinkInertia:
    """A random solid ellipsoid, turned and moved away from the link frame's origin."""
    mass = float(rng.uniform(0.3, 6.0))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    centre = rng.uniform(-0.2, 0.2, 3)
    spread = rotation @ np.diag(rng.uniform(0.02, 0.3, 3) ** 2 / 5.0) @ rotation.T + np.outer(centre, centre)
    return LinkInertia(mass, mass * centre, mass * (np.trace(spread) * np.eye(3) - spread))


BRANCHES = dict(zip(("shoulder", "elbow"), read_urdf_chain(URDF.encode(), "", "base", "tool").branches, strict=True))


def models(seed: int = 0) -> dict[str, JointModel]:
    rng = np.random.default_rng(seed)
    return {name: JointModel(ellipsoid(rng), friction(rng), 0.01, BRANCHES[name]) for name in ("shoulder", "elbow")}


def link_of(model: JointModel) -> LinkInertia:
    assert model.link is not None
    return model.link


def friction_of(model: JointModel) -> JointFriction:
    assert model.friction is not None
    return model.friction


def links_in(data: bytes, base: str, tip: str) -> dict[str, LinkInertia]:
    """The links that Tauscope's own reader finds, by joint name."""
    chain = read_urdf_chain(data, "file.urdf", base, tip)
    assert chain.links is not None
    return dict(zip(chain.joint_names, chain.links, strict=True))


def assert_same_link(found: LinkInertia, expected: LinkInertia) -> None:
    np.testing.assert_allclose(found.to_vector(), expected.to_vector(), rtol=1e-12, atol=1e-14)


def test_own_reader_finds_the_links_and_friction_that_were_written():
    written = models()
    patched = patch_urdf(URDF.encode(), written)
    found = links_in(patched.data, "base", "tool")
    assert list(found) == ["shoulder", "elbow"]
    for name, link in found.items():
        assert_same_link(link, link_of(written[name]))
    frictions = read_urdf_chain(patched.data, "two.urdf", "base", "tool").friction
    assert frictions is not None
    for name, coefficients in zip(found, frictions, strict=True):
        expected = friction_of(written[name])
        assert coefficients.stiction == pytest.approx(expected.stiction + expected.stribeck, rel=1e-15)
        assert coefficients.viscous == expected.viscous


def test_every_byte_outside_of_inertials_and_dynamics_stays():
    body = LinkInertia(2.0, np.array([0.5, 0.0, 0.0]), np.diag([0.5, 0.625, 0.625]))
    plain = JointFriction(1.5, 0.0, 0.25, 0.0, 100.0)
    patched = patch_urdf(URDF.encode(), {"shoulder": JointModel(body, plain), "elbow": JointModel(body, plain)})
    numbers = [
        ("<dynamics friction='0.1'   damping=\"0.2\"", "<dynamics friction='1.5'   damping=\"0.25\""),
        ('<mass value="1.0" />', '<mass value="2.0" />'),
        (
            '<origin rpy="0.3 0 0"\n              xyz="0.1 0 0" />',
            '<origin rpy="0 0 0"\n              xyz="0.25 0.0 0.0" />',
        ),
        (
            '<inertia izz="0.02" ixx="0.01" iyy="0.02" ixy="0" ixz="0" iyz="0"/>',
            '<inertia izz="0.5" ixx="0.5" iyy="0.5" ixy="0.0" ixz="0.0" iyz="0.0"/>',
        ),
        (
            '    <origin xyz="0.4 0 0"/>\n',
            '    <origin xyz="0.4 0 0"/>\n    <dynamics damping="0.25" friction="1.5"/>\n',
        ),
        (
            '  <link name="fore" />\n',
            '  <link name="fore" >\n    <inertial>\n      <origin xyz="0.25 0.0 0.0" rpy="0 0 0"/>\n'
            '      <mass value="2.0"/>\n      <inertia ixx="0.5" ixy="0.0" ixz="0.0" iyy="0.5" iyz="0.0" izz="0.5"/>\n'
            "    </inertial>\n  </link>\n",
        ),
        (
            '<mass value="0.5"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/>',
            '<mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        ),
        ('rg/wiki/xacro">', f'rg/wiki/xacro">\n  {comment_of(patched.data.decode())}'),
    ]
    expected = URDF
    for old, new in numbers:
        assert expected.count(old) == 1
        expected = expected.replace(old, new)
    assert patched.data.decode() == expected


def comment_of(text: str) -> str:
    """The comment that the export writes."""
    start = text.index("<!-- Model identified by Tauscope.")
    return text[start : text.index("-->", start) + 3]


def test_line_ends_byte_order_mark_and_foreign_names_stay():
    source = b"\xef\xbb\xbf" + URDF.replace("from CAD", "aus CAD: Gewicht geschätzt 机").replace("\n", "\r\n").encode()
    patched = patch_urdf(source, models()).data
    assert patched.startswith(b"\xef\xbb\xbf<?xml")
    assert "aus CAD: Gewicht geschätzt 机".encode() in patched
    assert patched.count(b"\n") == patched.count(b"\r\n")
    assert_same_link(links_in(patched, "base", "tool")["shoulder"], link_of(models()["shoulder"]))


def test_patching_twice_is_patching_once():
    first = patch_urdf(URDF.encode(), models(1)).data
    assert patch_urdf(first, models(1)).data == first
    again = patch_urdf(patch_urdf(URDF.encode(), models(2)).data, models(1)).data
    assert again == first


def test_inertial_that_is_incomplete_is_completed():
    source = """<robot name="r"><link name="b"/>
    <joint name="j" type="prismatic"><parent link="b"/><child link="l"/></joint>
    <link name="l">
      <inertial>
        <mass value="3"/>
      </inertial>
    </link></robot>"""
    link = ellipsoid(np.random.default_rng(3))
    patched = patch_urdf(source.encode(), {"j": JointModel(link)})
    assert_same_link(links_in(patched.data, "b", "l")["j"], link)
    assert read_urdf_chain(patched.data, "r.urdf", "b", "l").friction is None
    assert patched.notes == ()


def test_empty_inertial_and_namespaced_elements_are_filled():
    source = """<u:robot name="r" xmlns:u="urn:u"><u:link name="b"/><u:joint name="j" type="revolute">
    <u:parent link="b"/><u:child link="l"/></u:joint><u:link name="l"><u:inertial/></u:link></u:robot>"""
    written = JointModel(ellipsoid(np.random.default_rng(3)), JointFriction(1.0, 0.0, 0.5, 0.0, 100.0))
    patched = patch_urdf(source.encode(), {"j": written}).data
    assert b"<u:dynamics" in patched
    assert b"<inertial" not in patched
    assert_same_link(links_in(patched, "b", "l")["j"], link_of(written))


def test_notes_say_what_a_urdf_cannot_hold_and_what_was_merged():
    patched = patch_urdf(URDF.encode(), models())
    text = patched.data.decode()
    for word in (
        "no Stribeck effect",
        "offset is 0.05",
        "k_v = 500",
        "no rotor inertia",
        "its inertial is set to zero",
    ):
        assert any(word in note for note in patched.notes), word
        assert word in text
    assert any("jaw moves on joint finger beside the chain" in note for note in patched.notes)


def test_masses_in_mujoco_are_the_identified_ones_and_no_shape_adds_any():
    mujoco = pytest.importorskip("mujoco")
    source = URDF.replace('<mesh filename="package://a/upper &amp; more.stl"/>', '<box size="1 1 1"/>')
    written = models()
    model = mujoco.MjModel.from_xml_string(patch_urdf(source.encode(), written).data.decode())
    masses = dict(zip([model.body(k).name for k in range(model.nbody)], model.body_mass, strict=True))
    assert masses["upper"] == pytest.approx(link_of(written["shoulder"]).mass, rel=1e-12)
    assert masses["fore"] + masses["jaw"] == pytest.approx(link_of(written["elbow"]).mass, rel=1e-12)
    assert masses["jaw"] == pytest.approx(0.05)
    shoulder = friction_of(written["shoulder"])
    assert model.dof_damping[0] == shoulder.viscous
    assert model.dof_frictionloss[0] == pytest.approx(shoulder.stiction + shoulder.stribeck, rel=1e-15)


def test_pinocchio_reads_the_same_inertias():
    pin = pytest.importorskip("pinocchio")
    written = models()
    model = pin.buildModelFromXML(patch_urdf(URDF.encode(), written).data.decode())
    for name in ("shoulder", "elbow"):
        inertia = model.inertias[model.getJointId(name)]
        link = LinkInertia.from_vector(link_of(written[name]).to_vector() - BRANCHES[name].to_vector())
        assert inertia.mass == pytest.approx(link.mass, rel=1e-14)
        np.testing.assert_allclose(inertia.mass * inertia.lever, link.first_moment, atol=1e-14)
        np.testing.assert_allclose(inertia.matrix()[3:, 3:], link.inertia, atol=1e-14)


def without_numbers(text: str) -> str:
    """A URDF without the export's comment and without the values in its inertials and dynamics."""
    if "<!-- Model identified" in text:
        text = text.replace(f"\n  {comment_of(text)}", "", 1)
    # An inertial without rpy gets one.
    text = re.sub(r'(<inertial>(?:(?!</inertial>).)*<origin[^>]*?) rpy="[^"]*"', r"\1", text, flags=re.DOTALL)
    parts = re.split(r"(<inertial>.*?</inertial>|<dynamics[^>]*>)", text, flags=re.DOTALL)
    return "".join(re.sub('"[^"]*"', '""', part) if k % 2 else part for k, part in enumerate(parts))


@pytest.mark.parametrize(
    ("file", "base", "tip"),
    [("staubli-tx40/tx40.urdf", "base_link", "link_6"), ("kuka-lwr4/kuka_lwr4.urdf", "lwr_base_link", "lwr_7_link")],
)
def test_real_urdf_changes_only_where_it_should(file: str, base: str, tip: str):
    path = DATA / file
    if not path.is_file():
        pytest.skip(f"{file} is not here; set TAUSCOPE_DATA")
    source = path.read_bytes()
    before = read_urdf_chain(source, file, base, tip)
    rng = np.random.default_rng(4)
    written = {name: JointModel(ellipsoid(rng), friction(rng)) for name in before.joint_names}
    patched = patch_urdf(path, written).data
    after = read_urdf_chain(patched, file, base, tip)
    assert path.read_bytes() == source
    for name, link in links_in(patched, base, tip).items():
        assert_same_link(link, link_of(written[name]))
    for one, other in zip(before.segments, after.segments, strict=True):
        np.testing.assert_array_equal(one.before.translation, other.before.translation)
        np.testing.assert_array_equal(one.before.rotation, other.before.rotation)
    assert after.limits == before.limits
    assert without_numbers(patched.decode()) == without_numbers(source.decode())


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (b"", "not valid XML"),
        (b"<robot><link></robot>", "URDF:1: not valid XML: mismatched tag"),
        (b"<sdf/>", "outermost element is <sdf>"),
        (b"<robot name='r'/>", "joint 'shoulder' is not in the file"),
        (URDF.encode("utf-16"), "URDF:1: not UTF-8 text"),
        (URDF.encode("utf-16-le"), "URDF:1: not UTF-8 text"),
        (b'<!DOCTYPE r [<!ENTITY a "b">]><robot>&a;</robot>', "a DOCTYPE is not accepted"),
        (URDF.replace('child link="upper"', 'child link="gone"').encode(), "link 'gone' is not in the file"),
        (Path("/nowhere/arm.urdf"), "/nowhere/arm.urdf: cannot be read: No such file"),
    ],
)
def test_files_that_cannot_be_patched_are_refused_in_one_line(source: bytes | Path, message: str):
    with pytest.raises(ExportError) as caught:
        patch_urdf(source, models())
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.integers(0, len(URDF) - 1), st.integers(0, 40), st.text(st.sampled_from("<>/\"'=& \n-ax!0"), max_size=6))
def test_damaged_files_are_patched_or_refused_but_never_crash(start: int, length: int, text: str):
    damaged = URDF[:start] + text + URDF[start + length :]
    try:
        patched = patch_urdf(damaged.encode(), models()).data
    except ExportError:
        return
    assert patch_urdf(patched, models()).data == patched


def test_joints_and_links_that_cannot_be_written_are_refused():
    rng = np.random.default_rng(5)
    with pytest.raises(ExportError, match="joint 'flange' is fixed"):
        patch_urdf(URDF.encode(), {"flange": JointModel(ellipsoid(rng))})
    with pytest.raises(ExportError, match="did you mean 'elbow'"):
        patch_urdf(URDF.encode(), {"ellbow": JointModel(ellipsoid(rng))})
    for link in (
        LinkInertia(0.0, np.zeros(3), np.zeros((3, 3))),
        LinkInertia(1.0, np.zeros(3), np.diag([1.0, 0.1, 0.1])),
        LinkInertia(np.nan, np.zeros(3), np.eye(3)),
    ):
        with pytest.raises(ExportError, match="the link of joint 'elbow' cannot exist"):
            patch_urdf(URDF.encode(), {"elbow": JointModel(link)})


def test_hostile_names_stay_inside_the_comment():
    name = "a--> <evil/> &amp; --"
    source = URDF.replace('name="elbow"', f'name="{name.replace("&amp;", "&amp;amp;").replace("<", "&lt;")}"')
    written = {name: models()["elbow"]}
    patched = patch_urdf(source.encode(), written)
    chain = read_urdf_chain(patched.data, "two.urdf", "base", "tool")
    assert chain.joint_names == ("shoulder", name)
    assert b"<evil" not in patched.data


def random_arm(rng: np.random.Generator, count: int) -> Robot:
    """A chain of turning and sliding joints between arbitrary placements."""

    def placement() -> Placement:
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return Placement(rotation * np.linalg.det(rotation), rng.uniform(-0.4, 0.4, 3))

    types = [JointType.PRISMATIC if rng.random() < 0.3 else JointType.REVOLUTE for _ in range(count)]
    joints = tuple(
        Joint(f"joint{j + 1}", kind, JointLimits(position=(-2.0, 1.5), torque=40.0)) for j, kind in enumerate(types)
    )
    segments = tuple(Segment(kind, placement(), placement()) for kind in types)
    return Robot("arm", joints, segments, gravity=rng.normal(size=3) * 5.0)


def pinocchio_model(robot: Robot, links: list[LinkInertia]):
    """The same chain in Pinocchio: a joint frame is the frame before the motion, the link sits behind it."""
    pin = pytest.importorskip("pinocchio")
    model, parent, behind = pin.Model(), 0, pin.SE3.Identity()
    model.gravity.linear = robot.gravity
    for joint, segment, link in zip(robot.joints, robot.segments, links, strict=True):
        axis = pin.JointModelPZ() if segment.type is JointType.PRISMATIC else pin.JointModelRZ()
        before = pin.SE3(segment.before.rotation, segment.before.translation)
        parent = model.addJoint(parent, axis, behind * before, joint.name)
        behind = pin.SE3(segment.after.rotation, segment.after.translation)
        order = [6, 7, 8, 9, 0, 3, 1, 4, 5, 2]
        inertia = pin.Inertia.FromDynamicParameters(link.to_vector()[order])
        model.appendBodyToJoint(parent, inertia, behind)
    return pin, model


@pytest.mark.parametrize("count", [1, 2, 4, 7])
def test_mujoco_computes_the_torque_of_the_exported_arm(count: int):
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(count)
    robot = random_arm(rng, count)
    links = [ellipsoid(rng) for _ in range(count)]
    pin, reference = pinocchio_model(robot, links)
    exported = mjcf_of(robot, links, [friction(rng) for _ in range(count)])
    model = mujoco.MjModel.from_xml_string(exported.text)
    model.dof_damping[:] = 0.0
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    state, data = mujoco.MjData(model), reference.createData()
    for _ in range(20):
        q, qd, qdd = rng.uniform(-1, 1, count), rng.normal(size=count), rng.normal(size=count) * 3
        state.qpos, state.qvel, state.qacc = q, qd, qdd
        mujoco.mj_inverse(model, state)
        expected = pin.rnea(reference, data, q, qd, qdd)
        np.testing.assert_allclose(state.qfrc_inverse, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_mjcf_holds_friction_limits_armature_and_says_what_it_cannot():
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(8)
    robot = random_arm(rng, 3)
    frictions = [friction(rng), JointFriction(1.0, 0.5, 0.2, 0.0, 80.0, 5.0), JointFriction(0.0, 0.0, 0.0, 0.0, 80.0)]
    exported = mjcf_of(robot, [ellipsoid(rng) for _ in range(3)], frictions, [0.02, None, 0.0])
    model = mujoco.MjModel.from_xml_string(exported.text)
    np.testing.assert_allclose(model.dof_frictionloss, [f.stiction + f.stribeck for f in frictions], rtol=1e-15)
    np.testing.assert_array_equal(model.dof_damping, [f.viscous for f in frictions])
    np.testing.assert_array_equal(model.dof_armature, [0.02, 0.0, 0.0])
    np.testing.assert_array_equal(model.jnt_range, [[-2.0, 1.5]] * 3)
    np.testing.assert_array_equal(model.actuator_ctrlrange, [[-40.0, 40.0]] * 3)
    np.testing.assert_array_equal(model.opt.gravity, robot.gravity)
    lost = [note.split(":")[0] for note in exported.notes if "no Stribeck effect" in note]
    assert lost == ["joint1", "joint2"]
    assert any("joint1: MJCF has no constant torque" in note for note in exported.notes)
    assert not any(note.startswith("joint3") for note in exported.notes)


def test_friction_that_would_drive_a_joint_is_written_as_zero_and_said():
    rng = np.random.default_rng(9)
    robot = random_arm(rng, 1)
    exported = mjcf_of(robot, [ellipsoid(rng)], [JointFriction(-0.5, 0.0, -0.1, 0.0, 80.0)])
    assert 'damping="0.0" frictionloss="0.0"' in exported.text
    assert any("viscous = -0.1 would drive the joint" in note for note in exported.notes)
    assert any("stiction + stribeck = -0.5 would drive" in note for note in exported.notes)


@pytest.mark.parametrize("name", ['a"b', "a<b>&", "a--b -->", "new\nline", "机器人", "world", "bell\x07", "it's"])
def test_hostile_names_in_mjcf(name: str):
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(10)
    robot = random_arm(rng, 1)
    robot = Robot(name, (Joint(name),), robot.segments)
    text = mjcf_of(robot, [ellipsoid(rng)], [friction(rng)]).text
    model = mujoco.MjModel.from_xml_string(text)
    assert model.joint(0).name == name.replace("\x07", "\ufffd")
    assert model.nbody == 2


def test_rotor_that_no_motor_has_is_refused():
    rng = np.random.default_rng(11)
    robot = random_arm(rng, 1)
    with pytest.raises(ExportError, match="rotor inertia -1 must be 0 or more"):
        mjcf_of(robot, [ellipsoid(rng)], [friction(rng)], [-1.0])
