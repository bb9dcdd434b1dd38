"""URDF chains against Pinocchio: frames, merged inertias, limits, friction."""

from dataclasses import dataclass, field

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest

from robot.robot_texts import URDF, replaced
from tauscope.errors import RobotFileError
from tauscope.robot import JointType, Severity
from tauscope.robot.chain import Chain
from tauscope.robot.kinematics import link_placements, rotation_of_z_to
from tauscope.robot.robot import Coupling
from tauscope.robot.urdf import read_urdf_chain


@dataclass
class RandomUrdf:
    """Text of a random URDF, written element by element."""

    rng: np.random.Generator
    links: int = 0
    joints: list[str] = field(default_factory=list)
    text: list[str] = field(default_factory=list)

    def link(self, with_inertial: bool = True) -> str:
        """A link, with a physical inertial unless told otherwise; its name."""
        self.links += 1
        name = f"link{self.links}"
        cloud = self.rng.normal(0.0, 0.1, (6, 3))
        inertia = 0.3 * (np.sum(cloud**2) * np.eye(3) - cloud.T @ cloud)
        entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        values = " ".join(f'{key}="{float(inertia[place])!r}"' for key, place in entries.items())
        body = f"<inertial>{self.origin()}<mass value='{self.rng.uniform(0.1, 5.0)}'/><inertia {values}/></inertial>"
        self.text.append(f"<link name='{name}'>{body if with_inertial else ''}</link>")
        return name

    def joint(self, kind: str, parent: str, child: str) -> str:
        """A joint at a random place about a random axis; its name."""
        name = f"joint{len(self.joints) + 1}"
        self.joints.append(name)
        axis = " ".join(str(value) for value in self.rng.normal(size=3))
        self.text.append(
            f"<joint name='{name}' type='{kind}'>{self.origin()}<parent link='{parent}'/><child link='{child}'/>"
            f"<axis xyz='{axis}'/><limit lower='-3' upper='3' velocity='2' effort='50'/></joint>"
        )
        return name

    def origin(self) -> str:
        """A random origin element."""
        xyz, rpy = (" ".join(str(v) for v in self.rng.uniform(-s, s, 3)) for s in (0.5, 3.0))
        return f"<origin xyz='{xyz}' rpy='{rpy}'/>"

    def document(self) -> str:
        """The whole URDF."""
        return "<robot name='random'>" + "".join(self.text) + "</robot>"


@dataclass
class Case:
    """A random URDF, where its chain runs, and its moving joints."""

    text: str
    base: str
    tip: str
    moving: list[tuple[str, str]]


def random_case(seed: int) -> Case:
    """A chain of 1 to 7 moving joints, with fixed joints in it and fixed bodies beside it."""
    rng = np.random.default_rng(seed)
    urdf = RandomUrdf(rng)
    base = end = urdf.link()
    moving: list[tuple[str, str]] = []
    for _ in range(rng.integers(1, 8)):
        for _ in range(rng.integers(0, 3)):
            end = _extended(urdf, "fixed", end)
        kind = str(rng.choice(["revolute", "continuous", "prismatic"]))
        end = _extended(urdf, kind, end, with_inertial=rng.uniform() > 0.2)
        moving.append((urdf.joints[-1], kind))
        side = end
        for _ in range(rng.integers(0, 3)):
            side = _extended(urdf, "fixed", side if rng.uniform() > 0.5 else end)
    for _ in range(rng.integers(0, 2)):
        end = _extended(urdf, "fixed", end)
    return Case(urdf.document(), base, end, moving)


def _extended(urdf: RandomUrdf, kind: str, parent: str, with_inertial: bool = True) -> str:
    child = urdf.link(with_inertial)
    urdf.joint(kind, parent, child)
    return child


@pytest.mark.parametrize("seed", range(30))
def test_random_chain_has_pinocchios_frames_and_inertias(seed: int) -> None:
    case = random_case(seed)
    chain = read_urdf_chain(case.text.encode(), "random.urdf", case.base, case.tip)
    model = pinocchio.buildModelFromXML(case.text)
    data = model.createData()
    assert list(chain.joint_names) == [name for name, _ in case.moving]

    q = np.random.default_rng(seed).uniform(-2.0, 2.0, (5, len(case.moving)))
    placements = link_placements(chain.segments, q)
    assert chain.links is not None
    for sample, position in enumerate(q):
        pinocchio.forwardKinematics(model, data, _configuration(case, position))
        for j, (name, _) in enumerate(case.moving):
            expected = data.oMi[model.getJointId(name)].homogeneous
            np.testing.assert_allclose(placements[sample, j], expected, atol=1e-12)
    for link, (name, _) in zip(chain.links, case.moving, strict=True):
        m, mx, my, mz, xx, xy, yy, xz, yz, zz = model.inertias[model.getJointId(name)].toDynamicParameters()
        np.testing.assert_allclose(link.to_vector(), [xx, yy, zz, xy, xz, yz, m, mx, my, mz], rtol=1e-12, atol=1e-12)


def _configuration(case: Case, position: np.ndarray) -> np.ndarray:
    """Pinocchio's configuration, which holds cosine and sine of a continuous joint."""
    parts = [
        [np.cos(q), np.sin(q)] if kind == "continuous" else [q]
        for q, (_, kind) in zip(position, case.moving, strict=True)
    ]
    return np.concatenate(parts)


@pytest.mark.parametrize(
    "axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (1e-9, 0, -1), (1e-9, 0, 1), (0.6, -0.64, -0.48)]
)
def test_alignment_is_a_rotation_that_carries_z_to_the_axis(axis: tuple[float, float, float]) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    rotation = rotation_of_z_to(unit)
    np.testing.assert_allclose(rotation[:, 2], unit, atol=1e-15)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def _chain_of_bytes(data: bytes) -> Chain:
    return read_urdf_chain(data, "arm.urdf", "base", "tool")


def _chain(text: str = URDF, base: str = "base", tip: str = "tool") -> Chain:
    return read_urdf_chain(text.encode(), "arm.urdf", base, tip)


def test_limits_and_friction_are_read() -> None:
    chain = _chain()
    shoulder, elbow = chain.limits
    assert (shoulder.position, shoulder.velocity, shoulder.torque) == ((-2.0, 2.0), 1.5, 30.0)
    assert (elbow.position, elbow.velocity, elbow.torque) == (None, 2.5, 10.0)
    assert chain.friction is not None
    assert [(f.stiction, f.stribeck, f.viscous) for f in chain.friction] == [(0.2, 0.0, 0.5), (0.0, 0.0, 0.0)]
    assert [segment.type for segment in chain.segments] == [JointType.REVOLUTE, JointType.REVOLUTE]
    assert chain.link_names == (("upper",), ("lower", "tool"))
    assert chain.findings == ()


def test_without_any_inertial_or_dynamics_there_is_no_model() -> None:
    text = replaced(URDF, '<dynamics damping="0.5" friction="0.2"/>', "").replace("inertial", "visual")
    chain = _chain(text)
    assert chain.links is None
    assert chain.friction is None


def test_the_bases_own_inertial_is_no_model_of_the_moving_links() -> None:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = URDF.replace("inertial", "visual").replace('<link name="base"/>', f'<link name="base">{inertial}</link>')
    assert _chain(text).links is None


def test_link_without_inertial_is_massless_and_reported() -> None:
    start, end = URDF.index("<inertial>"), URDF.index("</inertial>") + len("</inertial>")
    chain = _chain(URDF[:start] + URDF[end:])
    assert chain.links is not None
    assert not np.any(chain.links[0].to_vector())
    assert chain.links[1].mass == 1.0
    assert [(f.severity, "massless" in f.text, "'upper'" in f.where) for f in chain.findings] == [
        (Severity.WARNING, True, True)
    ]


FINGER = """
  <link name="finger">
    <inertial><mass value="7"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="grip" type="prismatic"><parent link="tool"/><child link="finger"/><axis xyz="0 0 -1"/></joint>
</robot>"""


def test_what_moves_beside_the_chain_counts_as_rigid_and_is_noted() -> None:
    chain = _chain(replaced(URDF, "</robot>", FINGER))
    assert chain.links is not None
    assert chain.links[1].mass == 8.0
    assert chain.link_names == (("upper",), ("lower", "tool", "finger"))
    (note,) = chain.notes
    assert note.code == "rigid-branch"
    assert "joint 'grip' moves beside the chain and counts as rigid, with 7 kg" in note.text
    assert "locked: {grip: 0.02}" in str(note.remedy)


def test_locked_joint_stands_where_it_is_stated() -> None:
    text = replaced(URDF, "</robot>", FINGER)
    chain = read_urdf_chain(text.encode(), "arm.urdf", "base", "tool", {"grip": 0.5})
    assert chain.notes == ()
    assert chain.links is not None
    np.testing.assert_allclose(chain.links[1].first_moment, [0.0, 0.0, 7.0 * (0.2 - 0.5)])
    inner = read_urdf_chain(text.encode(), "arm.urdf", "base", "tool", {"shoulder": 0.7, "grip": 0.5})
    assert inner.joint_names == ("elbow",)
    whole = link_placements(chain.segments, np.array([[0.7, 0.3]]))
    np.testing.assert_allclose(link_placements(inner.segments, np.array([[0.3]]))[0, 0], whole[0, 1], atol=1e-15)
    with pytest.raises(RobotFileError, match=r"locked: joint 'gripp' is not in the file; did you mean 'grip'\?"):
        read_urdf_chain(text.encode(), "arm.urdf", "base", "tool", {"gripp": 0.5})


def test_chain_may_end_before_the_last_joint() -> None:
    chain = _chain(tip="upper")
    assert chain.joint_names == ("shoulder",)
    assert chain.links is not None
    assert chain.links[0].mass == 3.0
    assert ["'elbow'" in note.text for note in chain.notes] == [True]


def test_chain_runs_from_the_root_to_the_deepest_leaf_by_default() -> None:
    text = replaced(URDF, "</robot>", '<link name="world"/><joint name="free" type="floating"><parent link="world"/>'
                    '<child link="base"/></joint></robot>')  # fmt: skip
    chain = read_urdf_chain(text.encode(), "arm.urdf")
    assert (chain.base, chain.tip, chain.joint_names) == ("base", "tool", ("shoulder", "elbow"))
    assert [note.code for note in chain.notes] == ["default-chain"]


def test_joint_below_the_base_is_reported_as_standing_still() -> None:
    (found,) = (f for f in _chain(base="upper").findings)
    assert found.severity is Severity.INFO
    assert "'shoulder'" in found.where


def test_axis_of_any_length_gives_its_direction() -> None:
    longer = _chain(replaced(URDF, 'xyz="0 1 0"', 'xyz="0 3 0"'))
    np.testing.assert_array_equal(longer.segments[0].before.rotation, _chain().segments[0].before.rotation)
    assert [finding.severity for finding in longer.findings] == [Severity.INFO]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('lower="-2" upper="2"', 'lower="0" upper="0"'),
        ('lower="-2" upper="2"', ""),
        ('lower="-2" upper="2"', 'lower="-1e16" upper="1e16"'),
        ('lower="-2" upper="2"', 'lower="0" upper="-1"'),
        ('lower="-2" upper="2"', 'lower="-inf" upper="inf"'),
        ('<limit lower="-2" upper="2" velocity="1.5" effort="30"/>', ""),
    ],
)
def test_limits_that_exporters_write_for_unknown_are_not_stated(old: str, new: str) -> None:
    assert _chain(replaced(URDF, old, new)).limits[0].position is None


@pytest.mark.parametrize("value", ["0", "-1", "1e300", "inf", "nan"])
def test_effort_that_no_joint_has_is_not_stated(value: str) -> None:
    assert _chain(replaced(URDF, 'effort="30"', f'effort="{value}"')).limits[0].torque is None


def test_mimic_of_a_joint_that_is_not_there_moves_by_itself() -> None:
    chain = _chain(replaced(URDF, '<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="elbo"/>'))
    assert chain.joint_names == ("shoulder", "elbow")
    assert ["mimics joint 'elbo', which is not in the file" in finding.text for finding in chain.findings] == [True]


@pytest.mark.parametrize(("kind", "mass"), [("mass", 0.0), ("inertia", 2.0)])
def test_inertial_without_a_part_counts_it_as_zero(kind: str, mass: float) -> None:
    start = URDF.index(f"<{kind} ")
    chain = _chain(URDF[:start] + URDF[URDF.index("/>", start) + 2 :])
    assert chain.links is not None
    assert chain.links[0].mass == mass
    assert f"has no <{kind}>, which counts as zero" in chain.findings[0].text


def test_reversed_limits_count_as_not_stated_and_are_reported() -> None:
    chain = _chain(replaced(URDF, 'lower="-2"', 'lower="3"'))
    assert chain.limits[0].position is None
    assert ["lower 3 is above upper 2" in finding.text for finding in chain.findings] == [True]


def test_undeclared_prefix_is_read_as_ros_reads_it() -> None:
    gazebo = '<gazebo reference="upper"><sensor:camera name="c"><update>20</update></sensor:camera></gazebo></robot>'
    assert _chain(replaced(URDF, "</robot>", gazebo)).joint_names == ("shoulder", "elbow")


@pytest.mark.parametrize(("encoding", "declared"), [("latin-1", ""), ("latin-1", "latin-1"), ("utf-16", "utf-16")])
def test_text_of_any_encoding_is_read(encoding: str, declared: str) -> None:
    text = replaced(URDF, '"shoulder"', '"épaule"')
    if declared:
        text = replaced(text, "?>", f' encoding="{declared}"?>')
    chain = _chain_of_bytes(text.encode(encoding))
    assert chain.joint_names == ("épaule", "elbow")
    assert ["Latin-1" in finding.text for finding in chain.findings] == [True] * (not declared)


def test_a_closing_nul_ends_the_text() -> None:
    assert _chain(URDF + "\0").joint_names == _chain(URDF).joint_names


def test_definitions_left_over_from_xacro_are_ignored_and_named() -> None:
    left = '<xacro:macro name="m"><link name="no"/></xacro:macro></robot>'
    chain = _chain(replaced(URDF, "</robot>", left))
    assert ["left over from xacro" in finding.text for finding in chain.findings] == [True]


MIMIC = """
  <link name="hand"><inertial><mass value="1.5"/><origin xyz="0.1 0.02 0"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0.001" iyz="0"/></inertial></link>
  <joint name="wrist" type="revolute"><parent link="tool"/><child link="hand"/><origin xyz="0.1 0 0.1" rpy="0.1 0 0"/>
    <axis xyz="0 1 0"/><mimic joint="shoulder" multiplier="-0.5" offset="0.2"/></joint>
</robot>"""


def test_mimic_joint_follows_its_master() -> None:
    chain = _chain(replaced(URDF, "</robot>", MIMIC), tip="hand")
    assert chain.joint_names == ("shoulder", "elbow")
    assert [each.coupling for each in chain.segments] == [None, None, Coupling(0, -0.5, 0.2)]
    assert chain.link_names == (("upper",), ("lower", "tool"), ("hand",))


def test_mimic_joint_beside_the_chain_follows_a_locked_master() -> None:
    mirror = FINGER.replace("finger", "mirror").replace('"grip"', '"mirror"').replace(
        "</joint>", '<mimic joint="grip" multiplier="2" offset="0.01"/></joint>')  # fmt: skip
    text = replaced(replaced(URDF, "</robot>", FINGER), "</robot>", mirror)
    chain = read_urdf_chain(text.encode(), "arm.urdf", "base", "tool", {"grip": 0.5})
    assert chain.notes == ()
    assert chain.links is not None
    np.testing.assert_allclose(chain.links[1].first_moment, [0, 0, 7.0 * (0.2 - 0.5) + 7.0 * (0.2 - 1.01)], atol=1e-15)


def test_default_namespace_is_accepted() -> None:
    text = replaced(URDF, "<robot ", '<robot xmlns="http://www.ros.org" ')
    np.testing.assert_array_equal(_chain(text).segments[0].before.rotation, _chain().segments[0].before.rotation)


INERTIA = 'ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"'
ERRORS = {
    "missing tip": ("", "", r"arm\.urdf: the tip link 'tol' .*did you mean 'tool'\?"),
    "text in a number": ('value="2.0"', 'value="2,0"', r":7: mass: value='2,0' is not a finite number"),
    "NaN": ('value="2.0"', 'value="nan"', r":7: mass: value='nan' is not a finite number"),
    "infinity": ('value="2.0"', 'value="1e999"', r":7: mass: value='1e999' is not a finite number"),
    "huge": ('value="2.0"', 'value="1e99"', r":7: mass: value=1e\+99 is beyond"),
    "Python's underscore": ('value="2.0"', 'value="2_0"', r":7: mass"),
    "two numbers": ('xyz="0 0 0.3"', 'xyz="0 0.3"', r":19: origin: xyz='0 0\.3' must hold three numbers"),
    "no inertia entry": ('ixx="0.02" ', "", r":8: inertia: the attribute 'ixx' is missing"),
    "zero axis": ('xyz="0 1 0"', 'xyz="0 0 0"', r":18: joint 'shoulder': its axis is zero"),
    "unknown joint type": ('type="revolute"', 'type="revolut"', r"joint 'shoulder': type 'revolut' .*'revolute'\?"),
    "planar joint": ('type="revolute"', 'type="planar"', r"joint 'shoulder': type planar is not supported"),
    "mimic of itself": ('<axis xyz="0 1 0"/>', '<mimic joint="shoulder"/>', r"joint 'shoulder': mimics itself"),
    "expression": ('value="2.0"', 'value="${2*m}"', r":7: mass: value='\$\{2\*m\}' is an expression of xacro; expand"),
    "unknown parent": ('parent link="base"', 'parent link="bose"', r"link 'bose' is not in the file; .*'base'\?"),
    "no child": ('<child link="upper"/>', "", r"joint 'shoulder': must hold one <child link=…> element"),
    "link twice": ('<link name="tool"/>', '<link name="tool"/><link name="tool"/>', r"'tool': the link stands"),
    "joint twice": ('name="elbow"', 'name="shoulder"', r":26: joint 'shoulder': the .*twice, first on line 18"),
    "two parents": ('child link="lower"', 'child link="upper"', r"'upper' already hangs on joint 'shoulder'"),
    "nameless link": ('<link name="tool"/>', '<link name="tool"/><link/>', r":17: link: needs a printable name"),
    "broken XML": ("</robot>", "", r"arm\.urdf:39: not valid XML"),
    "not a robot": ("", "", r"root element is <robot>"),
    "DOCTYPE": ("<robot ", "<!DOCTYPE robot>\n<robot ", r"arm\.urdf:2: a DOCTYPE is not accepted"),
    "xacro": ("<robot ", '<robot xmlns:x="http://www.ros.org/wiki/xacro" ', r"is a xacro; expand the file first"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_invalid_urdf_is_refused_by_name_and_line(name: str) -> None:
    old, new, message = ERRORS[name]
    text, tip = URDF.replace(old, new, 1) if old else URDF, "tool"
    if name == "missing tip":
        tip = "tol"
    elif name == "not a robot":
        text = "<sdf/>"
    elif name == "xacro":
        text = text.replace('<link name="tool"/>', '<link name="tool"/><x:wrist name="m"/>')
    with pytest.raises(RobotFileError, match=message) as caught:
        _chain(text, tip=tip)
    assert "\n" not in str(caught.value)


def test_loop_is_refused() -> None:
    back = "<joint name='back' type='fixed'><parent link='tool'/><child link='base'/></joint></robot>"
    text = replaced(URDF, "</robot>", back)
    with pytest.raises(RobotFileError, match="the joints form a loop"):
        _chain(text)


def test_tip_and_base_of_different_branches_are_refused() -> None:
    with pytest.raises(RobotFileError, match="the tip 'base' hangs on 'base', not on the base 'tool'"):
        _chain(base="tool", tip="base")


def test_chain_without_a_moving_joint_is_refused() -> None:
    for base, tip in (("lower", "tool"), ("tool", "tool")):
        with pytest.raises(RobotFileError, match="no moving joint"):
            _chain(base=base, tip=tip)


def test_entity_bomb_is_refused_unexpanded() -> None:
    levels = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 12))
    bomb = f'<!DOCTYPE robot [<!ENTITY e0 "bomb">{levels}]><robot name="&e11;"><link name="&e11;"/></robot>'
    with pytest.raises(RobotFileError, match="a DOCTYPE is not accepted"):
        _chain(bomb)


def test_entity_that_reads_a_file_is_refused() -> None:
    text = '<!DOCTYPE robot [<!ENTITY f SYSTEM "file:///etc/passwd">]><robot name="x"><link name="l">&f;</link></robot>'
    with pytest.raises(RobotFileError, match="a DOCTYPE is not accepted"):
        _chain(text)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "latin-1"])
def test_doctype_cannot_hide_in_another_encoding(encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?><!-- é --><!DOCTYPE robot><robot/>'
    with pytest.raises(RobotFileError, match="a DOCTYPE is not accepted"):
        read_urdf_chain(text.encode(encoding), "arm.urdf", "base", "tool")


def test_unphysical_inertial_is_repaired_in_the_frame_of_its_link() -> None:
    chain = _chain(replaced(URDF, 'izz="0.04"', 'izz="0.4"'))
    (repair,) = chain.repairs
    assert chain.findings == ()
    assert (repair.link, repair.place) == (0, "arm.urdf:5: inertial of link 'upper'")
    assert "0.02 + 0.03 < 0.4" in repair.text
    assert chain.links is not None
    stated = _chain(URDF).links
    assert stated is not None
    np.testing.assert_allclose(
        (repair.after.to_vector() - chain.links[0].to_vector())[6:],
        (repair.before.to_vector() - stated[0].to_vector())[6:],
    )


def test_origin_given_twice_counts_once_and_is_reported() -> None:
    text = replaced(URDF, '<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 0"/><origin xyz="9 9 9"/>')
    chain = _chain(text)
    np.testing.assert_array_equal(chain.segments[1].before.translation, [0.4, 0.0, 0.0])
    assert ["2 <origin>" in finding.text for finding in chain.findings] == [True]
