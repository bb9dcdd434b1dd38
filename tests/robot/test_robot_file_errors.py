"""The robot file: every refusal names file, line, place, joint and what to do."""

import re
from pathlib import Path

import pytest

from robot.robot_texts import ROBOT_YAML, URDF, URDF_ROBOT_YAML, replaced, write_robot
from tauscope.errors import RobotFileError
from tauscope.robot import read_robot

LINK_2 = "{mass: 1.4, first_moment: [0.1, 0, 0], inertia: {xx: 0.02, yy: 0.03, zz: 0.03, xy: 0, xz: 0, yz: 0}}"

ERRORS = {
    "limits reversed": (
        "[-2.9, 2.9]",
        "[2.0, 1.0]",
        "9: joints[0].limits.position (joint 1, 'shoulder'): lower bound 2 is not below upper bound 1; swap them",
    ),
    "limits equal": (
        "[-2.9, 2.9]",
        "[1.0, 1.0]",
        "9: joints[0].limits.position (joint 1, 'shoulder'): lower and upper",
    ),
    "three limits": ("[-2.9, 2.9]", "[1, 2, 3]", "9: joints[0].limits.position (joint 1, 'shoulder'): must be two"),
    "limit no list": ("[-2.9, 2.9]", "2.9", "9: joints[0].limits.position (joint 1, 'shoulder'): must be a list"),
    "text in a number": ("2.0, acc", "fast, acc", "9: joints[0].limits.velocity (joint 1, 'shoulder'): 'fast' is text"),
    "number in quotes": ("2.0, acc", "'2.0', acc", "9: joints[0].limits.velocity (joint 1, 'shoulder'): '2.0' is text"),
    "unit": ("torque: 40", "torque: 40 Nm", "9: joints[0].limits.torque (joint 1, 'shoulder'): '40 Nm' is text"),
    "zero velocity": ("2.0, acc", "0, acc", "limits.velocity (joint 1, 'shoulder'): must be above zero, but is 0"),
    "negative torque": (
        "torque: 40",
        "torque: -4",
        "limits.torque (joint 1, 'shoulder'): must be above zero, but is -4",
    ),
    "truth for a number": ("2.0, acc", "true, acc", "(joint 1, 'shoulder'): must be a number, but is true"),
    "NaN": ("d: 0.3", "d: .nan", "4: kinematics.dh[0].d (joint 1, 'shoulder'): must be a finite number, but is nan"),
    "infinity": ("d: 0.3", "d: -.inf", "4: kinematics.dh[0].d (joint 1, 'shoulder'): must be a finite number"),
    "overflow": ("d: 0.3", "d: 1e999", "4: kinematics.dh[0].d (joint 1, 'shoulder'): must be a finite number"),
    "huge": ("d: 0.3", "d: 1e99", "4: kinematics.dh[0].d (joint 1, 'shoulder'): 1e+99 is beyond 1e+09; check the unit"),
    "huge integer": (
        "d: 0.3",
        "d: " + "9" * 400,
        "4: kinematics.dh[0].d (joint 1, 'shoulder'): an integer of 1329 bits",
    ),
    "endless integer": ("d: 0.3", "d: " + "9" * 9000, "4: '99999"),
    "octal or decimal": ("d: 0.3", "d: 010", "4: '010' cannot be read as a number"),
    "joint type": ("prismatic", "slider", "5: kinematics.dh[1].type (joint 2, 'slide'): 'slider' is not a joint type"),
    "missing row key": (
        "d: 0.3, ",
        "",
        "4: kinematics.dh[0].d (joint 1, 'shoulder'): the key 'd' is missing; add it",
    ),
    "unknown row key": ("d: 0.3", "D: 0.3", "4: kinematics.dh[0].D (joint 1, 'shoulder'): unknown key 'D'"),
    "empty rows": (
        ROBOT_YAML[ROBOT_YAML.index("  dh:") : ROBOT_YAML.index("gravity")],
        "  dh: []\n",
        "must not be an empty",
    ),
    "two descriptions": (
        "  dh:",
        "  urdf: {file: a, base: b, tip: c}\n  dh:",
        "2: kinematics: must hold exactly one of dh,",
    ),
    "no description": (
        "  dh:",
        "  dh: null\nx:",
        "unknown key 'x'; known here: gravity, joints, kinematics, locked, model",
    ),
    "unknown description": ("  dh:", "  mdhh:", "3: kinematics.mdhh: unknown key 'mdhh'; did you mean 'mdh'?"),
    "unknown key": (
        "gear_ratio",
        "gearratio",
        "10: joints[0].gearratio (joint 1, 'shoulder'): unknown key 'gearratio'; did",
    ),
    "unknown limit": (
        "velocity: 2",
        "speed: 2",
        "9: joints[0].limits.speed (joint 1, 'shoulder'): unknown key 'speed'",
    ),
    "unknown top key": (
        "gravity:",
        "gravitation:",
        "6: gravitation: unknown key 'gravitation'; did you mean 'gravity'?",
    ),
    "gravity": ("[0, 0, -9.81]", "-9.81", "6: gravity: must be a list, but is -9.81"),
    "gravity of two": ("[0, 0, -9.81]", "[0, -9.81]", "6: gravity: must be three numbers [x, y, z], but holds 2"),
    "no name": ("name: two-joint-arm\n", "", "name: the key 'name' is missing; add it"),
    "number as name": ("two-joint-arm", "5", "1: name: must be text, but is 5; put it in quotes"),
    "empty name": ("two-joint-arm", "''", "1: name: must not be empty"),
    "unprintable name": ("two-joint-arm", '"a\\nb"', "1: name: 'a\\nb' must be printable text"),
    "joint without name": (
        "- name: slide\n    lim",
        "- lim",
        "15: joints[1].name (joint 2): the key 'name' is missing",
    ),
    "joint is text": (
        "- name: slide\n    limits: {position: [0.0, 0.4]}",
        "- slide",
        "15: joints[1] (joint 2): must be a mapping",
    ),
    "joints are a mapping": ("joints:\n  - name: shoulder\n", "joints:\n    name: shoulder\n", "not valid YAML"),
    "one joint too few": (
        "  - name: slide\n    limits: {position: [0.0, 0.4]}\n",
        "",
        "7: joints: number of entries is 1, of joints in kinematics.dh 2; write one entry a joint",
    ),
    "same name twice": (
        "name: slide",
        "name: shoulder",
        "7: joints: joints 1 and 2 are both named 'shoulder'; rename one",
    ),
    "sign": ("sign: -1", "sign: 2", "12: joints[0].sign (joint 1, 'shoulder'): must be 1 or -1, but is 2"),
    "sign as truth": (
        "sign: -1",
        "sign: true",
        "12: joints[0].sign (joint 1, 'shoulder'): must be 1 or -1, but is true",
    ),
    "torque constant": (
        "0.5\n    sign",
        "0\n    sign",
        "11: joints[0].torque_constant (joint 1, 'shoulder'): must not be zero",
    ),
    "gear ratio": (
        "gear_ratio: 100",
        "gear_ratio: 0.0",
        "10: joints[0].gear_ratio (joint 1, 'shoulder'): must not be zero",
    ),
    "friction shape": ("k_v: 500", "k_v: -5", "13: joints[0].friction_shape.k_v (joint 1, 'shoulder'): must be above"),
    "drive": ("{bus: can0, node: 3}", "can0", "14: joints[0].drive (joint 1, 'shoulder'): must be a mapping"),
    "drive with NaN": ("node: 3", "node: .nan", "14: joints[0].drive (joint 1, 'shoulder'): must hold finite numbers"),
    "one link too few": (
        f"    - {LINK_2}\n",
        "",
        "18: model.links: number of entries is 1, of joints in kinematics.dh 2",
    ),
    "one friction too few": (
        "    - {stiction: 1.0, stribeck: -0.2, viscous: 0.25}\n",
        "",
        "21: model.friction: number of entries is 1, of joints in kinematics.dh 2",
    ),
    "inertia key": (
        "xx: 0.02",
        "Ixx: 0.02",
        "20: model.links[1].inertia.Ixx (link 2, 'slide'): unknown key 'Ixx'; did",
    ),
    "friction NaN": (
        "stiction: 2.0",
        "stiction: .nan",
        "22: model.friction[0].stiction (joint 1, 'shoulder'): must be a",
    ),
    "key twice": ("sign: -1", "gear_ratio: 2", "12: the key 'gear_ratio' stands twice, first on line 10; remove one"),
    "key no text": ("sign: -1", "1: -1", "12: a key must be text; put it in quotes"),
    "merge key": ("sign: -1", "<<: {sign: -1}", "12: merge keys (<<) are not accepted"),
    "tag": ("sign: -1", "sign: !!python/name:os.system x", "12: the tag 'tag:yaml.org,2002:python/name:os.system' is"),
    "tagged mapping": ("kinematics:", "kinematics: !x", "2: the tag '!x' is not accepted"),
    "undefined alias": ("sign: -1", "sign: *x", "12: not valid YAML: found undefined alias 'x'"),
    "tab": ("    sign: -1", "\tsign: -1", "12: not valid YAML: found character"),
    "second document": ("joints:", "---\njoints:", "not valid YAML: but found another document"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_invalid_robot_file_is_refused_by_line_place_and_joint(tmp_path: Path, name: str) -> None:
    old, new, message = ERRORS[name]
    path = write_robot(tmp_path, replaced(ROBOT_YAML, old, new))
    with pytest.raises(RobotFileError) as caught:
        read_robot(path)
    text = str(caught.value)
    assert text.startswith(f"{path}:")
    assert message in text
    assert text.isprintable()
    if re.match("[0-9]+:", message):
        assert text.startswith(f"{path}:{message}")


def test_first_of_several_errors_is_said_to_be_so(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ROBOT_YAML.replace("theta: 0", "theta: x0"))
    with pytest.raises(RobotFileError, match=r"kinematics\.dh\[0\]\.theta .*\(the first of 2 errors\)"):
        read_robot(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"# nothing\n", "the file holds no entries"),
        (b"name: a\n\n\xff\n", ":3: byte 0xff is not UTF-8 text"),
        (ROBOT_YAML.encode("utf-16"), "is not UTF-8 text"),
        (b"name: \x00", "not valid YAML"),
        (b"just text", ":1: must be a mapping with name and kinematics, but is 'just text'"),
        (b"- a\n- b\n", ":1: must be a mapping with name and kinematics, but is a list of 2"),
        (
            b"<sdf version='1.7'/>",
            ":1: its root element is <sdf>; give the URDF or xacro that it was made from, or an MJCF: pip install",
        ),
        (b'a: "\\UFFFFFFFF"', "not valid YAML"),
        (b"[" * 5000, ":1: nested deeper than 24 levels"),
        (b"- " * 5000, ":1: nested deeper than 24 levels"),
        (b"- 1\n" * 100_000, ":10000: more than 10000 entries"),
        (b"#" * (1024 * 1024 + 1), "the file is larger than 1024 KiB"),
        (b"a: &a [*a]\n", "aliases (*name) expand without end"),
    ],
)
def test_what_is_no_robot_file_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = write_robot(tmp_path, content)
    with pytest.raises(RobotFileError) as caught:
        read_robot(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    assert str(caught.value).isprintable()


def test_alias_bomb_is_refused_unexpanded(tmp_path: Path) -> None:
    levels = "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12))
    path = write_robot(tmp_path, f"a0: &a0 bomb\n{levels}")
    with pytest.raises(RobotFileError, match="expand without end"):
        read_robot(path)


def test_missing_file_folder_and_device_are_refused(tmp_path: Path) -> None:
    for path, message in (
        (tmp_path / "none.yaml", "none.yaml: no such file; check the path"),
        (tmp_path, "is a directory; give the path of a file"),
        (Path("/dev/null"), "is not a regular file"),
        (Path("a\0b"), "cannot be read"),
    ):
        with pytest.raises(RobotFileError) as caught:
            read_robot(path)
        assert message in str(caught.value)


def test_missing_urdf_names_the_place_in_the_robot_file(tmp_path: Path) -> None:
    path = write_robot(tmp_path, URDF_ROBOT_YAML)
    with pytest.raises(RobotFileError, match=r"arm\.yaml:3: kinematics\.urdf\.file: .*arm\.urdf: no such file"):
        read_robot(path)


def test_joint_that_the_chain_has_not_is_refused_with_the_chains_names(tmp_path: Path) -> None:
    path = write_robot(tmp_path, URDF_ROBOT_YAML + "joints:\n  - name: flange\n", URDF)
    message = r":5: joints\[0\]\.name \(joint 1, 'flange'\): 'flange' is no .*its joints are 'shoulder', 'elbow'"
    with pytest.raises(RobotFileError, match=message):
        read_robot(path)


def test_locked_joint_of_rows_is_refused(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ROBOT_YAML + "locked: {slide: 0.1}\n")
    with pytest.raises(RobotFileError, match=r"locked: needs kinematics from a URDF or MJCF"):
        read_robot(path)


def test_error_in_the_urdf_names_the_urdf_and_its_line(tmp_path: Path) -> None:
    path = write_robot(tmp_path, URDF_ROBOT_YAML, replaced(URDF, 'value="2.0"', 'value="two"'))
    with pytest.raises(RobotFileError, match=r"arm\.urdf:7: mass: value='two' is not a finite number"):
        read_robot(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 1.4", "mass: -1.4", "mass -1.4 kg is negative"),
        ("mass: 1.4", "mass: 0", "mass is zero but the first moment is [0.1, 0, 0] kg m"),
        ("xx: 0.02, yy: 0.03", "xx: -0.02, yy: 0.03", "inertia is not positive semidefinite: principal moments"),
        ("zz: 0.03, xy", "zz: 0.08, xy", "inertia breaks the triangle inequality: 0.02 + 0.03 < 0.08 kg m²"),
        ("xx: 0.02, yy: 0.03, zz: 0.03", "xx: 0.01, yy: 0.006, zz: 0.006", "inertia is not positive semidefinite"),
        ("xy: 0, xz: 0, yz: 0}}\n  fr", "xy: 0.1, xz: 0, yz: 0}}\n  fr", "inertia is not positive semidefinite"),
    ],
)
def test_impossible_body_in_the_model_is_repaired_and_named_by_link_and_condition(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = write_robot(tmp_path, replaced(ROBOT_YAML, old, new))
    (warning,) = read_robot(path).warnings
    assert (warning.code, warning.joint) == ("repaired-inertial", "slide")
    assert warning.text.startswith(f"{path}:20: model.links[1] (link 2, 'slide'): {message}")
    assert "about the link frame's origin" in str(warning.remedy)


def test_impossible_inertial_of_a_urdf_is_repaired(tmp_path: Path) -> None:
    path = write_robot(tmp_path, URDF_ROBOT_YAML, replaced(URDF, 'izz="0.04"', 'izz="0.4"'))
    (warning,) = read_robot(path).warnings
    assert "arm.urdf:5: inertial of link 'upper': inertia breaks the triangle inequality: 0.02 + 0.03" in warning.text
    assert "the nearest body is used: principal moments [0.02, 0.03, 0.4] → [0.195, 0.205, 0.4] kg m²" in warning.text
    assert warning.remedy == "correct the <inertial>"


@pytest.mark.parametrize("named", [True, False])
def test_an_installed_xacro_expands_what_needs_it(named: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "bin" / "xacro"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\nsed -e "s/\\${2 \\* 1.0}/2.0/" "$1" | grep -v fails || { echo no >&2; exit 2; }\n')
    program.chmod(0o755)
    text = URDF.replace('value="2.0"', 'value="${2 * 1.0}"', 1)
    assert text != URDF
    for path, content in ((tmp_path / "arm.urdf", text), (tmp_path / "robot.yaml", URDF_ROBOT_YAML)):
        path.write_text(content, encoding="utf-8")
    path = tmp_path / ("robot.yaml" if named else "arm.urdf")
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(RobotFileError, match="is an expression of xacro; expand the file first"):
        read_robot(path)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    robot = read_robot(path)
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    links = robot.model.links, read_robot(path).model.links
    assert [link.mass for link in links[0] or ()] == [link.mass for link in links[1] or ()]
    (tmp_path / "arm.urdf").write_text(text.replace("\n", "<!-- fails -->\n"), encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"arm\.urdf: xacro cannot expand the file \(no\)$"):
        read_robot(path)
