"""Damaged robot files and URDFs: an error of ours, in one line, or a sound robot; never anything else."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from robot.robot_texts import ROBOT_YAML, URDF, URDF_ROBOT_YAML, write_robot
from tauscope.errors import RobotFileError
from tauscope.robot import check_robot, find_defect, read_robot, robot_from_dict, robot_to_dict
from tauscope.robot.kinematics import link_placements

TOKEN = re.compile(r"\s+|[-+.\w]+|[^\s\w]")
NUMBERS = [
    "0.5",
    "1e-3",
    "2",
    "3",
    "nan",
    ".nan",
    "inf",
    "-.inf",
    "1e999",
    "1e308",
    "-1e308",
    "5e-324",
    "-1",
    "0",
    "1_0",
    "9" * 5000,
    "\u0661",
    "0x1F",
]
YAML_PIECES = [
    *("[", "]", "{", "}", ":", ",", "- ", "? ", "\n", "\t", "'", '"', "#", "---", "...", "%YAML 1.1\n---\n", "|", ">-"),
    *(
        "&a ",
        "*a",
        "<<",
        "!!float ",
        "!!set ",
        "!x ",
        "null",
        "true",
        "text",
        "'1'",
        "[1, 2]",
        "{}",
        "\x00",
        "\x85",
        "é",
    ),
    *("dh", "mdh", "urdf", "joints", "model", "limits", "name", "'\\", '"\\U', "a" * 300, "\ud7ff", "\u2028"),
]
URDF_PIECES = [
    *(
        "<",
        ">",
        "/>",
        "</",
        '"',
        "=",
        "&",
        "&amp;",
        "&e;",
        "&#0;",
        "&#x110000;",
        "<!--",
        "-->",
        "]]>",
        "<![CDATA[",
        "<?x",
    ),
    *("<!DOCTYPE robot>", "<mimic/>", "<axis/>", "<origin/>", "<inertial/>", 'xmlns="a"', "xmlns:x='b'", "x:link"),
    *("fixed", "floating", "planar", "prismatic", "revolute", "base", "upper", "lower", "tool", "shoulder", "elbow"),
    *("\x00", "é", " ", "\n", "0 0 0", "1 2", "text"),
]


@st.composite
def mutated(draw: st.DrawFn, text: str, pieces: list[str]) -> bytes:
    """The text with one to four tokens deleted, doubled, exchanged or preceded by others, perhaps cut off."""
    tokens = TOKEN.findall(text)
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3, 4]))):
        if not tokens:
            break
        place = draw(st.integers(0, len(tokens) - 1))
        operation = draw(st.sampled_from(["delete", "double", "swap", "replace", "insert", "number"]))
        if operation == "delete":
            del tokens[place : place + draw(st.integers(1, 12))]
        elif operation == "double":
            tokens[place:place] = tokens[place : place + draw(st.integers(1, 60))]
        elif operation == "swap":
            other = draw(st.integers(0, len(tokens) - 1))
            tokens[place], tokens[other] = tokens[other], tokens[place]
        elif operation == "number":
            numeric = [i for i, token in enumerate(tokens) if token[-1:].isdigit()] or [place]
            tokens[draw(st.sampled_from(numeric))] = draw(st.sampled_from(NUMBERS))
        else:
            piece = draw(st.one_of(st.sampled_from(pieces), st.sampled_from(NUMBERS), st.text(max_size=4)))
            tokens[place : place + (operation == "replace")] = [piece]
    data = "".join(tokens).encode("utf-8", "surrogatepass")
    if draw(st.integers(0, 9)) == 0:
        data = data[: draw(st.integers(0, len(data)))]
    if draw(st.integers(0, 19)) == 0:
        place = draw(st.integers(0, len(data)))
        data = data[:place] + draw(st.binary(min_size=1, max_size=3)) + data[place:]
    return data


def _assert_sound_or_refused(path: Path) -> None:
    """Read, check and convert the robot file: each refuses it in one line, or gives finite numbers."""
    before = {file: file.read_bytes() for file in path.parent.iterdir()}
    try:
        robot = read_robot(path)
    except RobotFileError as error:
        event("refused")
        message = str(error)
        assert message.isprintable()
        assert message.startswith(str(path.parent))
        assert len(message) < 700
        _assert_check_agrees(path)
    else:
        event("sound")
        placements = link_placements(robot, np.ones((2, robot.joint_count)))
        assert np.all(np.isfinite(placements))
        assert len(robot.joints) == len(robot.segments) == placements.shape[1] > 0
        for link in robot.model.links or ():
            assert np.all(np.isfinite(link.to_vector()))
            assert find_defect(link, 1e-8) is None
        assert len(check_robot(path).findings) >= len(robot.repairs)
        assert robot_to_dict(robot_from_dict(robot_to_dict(robot))) == robot_to_dict(robot)
    assert {file: file.read_bytes() for file in path.parent.iterdir()} == before


def _assert_check_agrees(path: Path) -> None:
    """What `read_robot` refuses, `check_robot` refuses."""
    with pytest.raises(RobotFileError):
        check_robot(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all examples share."""
    return tmp_path_factory.mktemp("mutations")


QUICK = settings(suppress_health_check=[HealthCheck.too_slow])
THOROUGH = settings(max_examples=2000, suppress_health_check=[HealthCheck.too_slow])


@QUICK
@given(data=mutated(ROBOT_YAML, YAML_PIECES))
def test_damaged_robot_file_is_refused_or_sound(folder: Path, data: bytes) -> None:
    _assert_sound_or_refused(write_robot(folder, data))


@QUICK
@given(data=mutated(URDF, URDF_PIECES))
def test_damaged_urdf_is_refused_or_sound(folder: Path, data: bytes) -> None:
    _assert_sound_or_refused(write_robot(folder, URDF_ROBOT_YAML, data))


@pytest.mark.proof
@pytest.mark.timeout(1200)
@THOROUGH
@given(data=mutated(ROBOT_YAML, YAML_PIECES))
def test_damaged_robot_file_is_refused_or_sound_thoroughly(folder: Path, data: bytes) -> None:
    _assert_sound_or_refused(write_robot(folder, data))


@pytest.mark.proof
@pytest.mark.timeout(1200)
@THOROUGH
@given(data=mutated(URDF, URDF_PIECES))
def test_damaged_urdf_is_refused_or_sound_thoroughly(folder: Path, data: bytes) -> None:
    _assert_sound_or_refused(write_robot(folder, URDF_ROBOT_YAML, data))


KEYS = st.sampled_from(["name", "kinematics", "dh", "segments", "type", "joints", "model", "links", "friction", "x"])
LEAF = st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5)
JSON = st.recursive(LEAF, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner), max_leaves=15)


@given(st.dictionaries(KEYS, JSON))
def test_any_json_is_refused_or_sound(data: dict[str, object]) -> None:
    message = ""
    try:
        robot_from_dict(data)
    except RobotFileError as error:
        message = str(error)
    assert message.isprintable()
