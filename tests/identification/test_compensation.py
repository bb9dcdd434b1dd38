"""Friction compensation files: every language computes the same torque, whatever the names hold."""

import json
import math
import shutil
import subprocess
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from tauscope.errors import ExportError
from tauscope.export.compensation.model import (
    CompensationModel,
    DriveUnits,
    JointCompensation,
    JointFriction,
    RecordingSource,
    drive_units,
    to_document,
    to_json,
    to_yaml,
)
from tauscope.export.compensation.source_code import c_string, comment_text, identifier, to_c_header, to_python
from tauscope.recording import EffortKind
from tauscope.robot import Joint, JointType

VELOCITIES = np.concatenate([[0.0], np.geomspace(1e-6, 30.0, 25), -np.geomspace(1e-6, 30.0, 25)])

HOSTILE = (
    "*/ int main(void) { return 1; } /*",
    'quote " back \\ slash',
    "new\nline\r\ttab",
    "trigraph ??/",
    "Gelenk-Ärm 机器人 \u2028 \x00 \x1b[31m",
    '"""\nraise SystemExit(1)\n"""',
    "%s {0} ${HOME}",
    "1e3",
    "no",
    "",
)


def model(robot: str = "rrr-arm", names: tuple[str, ...] = ("joint1", "joint2", "slide")) -> CompensationModel:
    """Three joints with awkward numbers, one of them prismatic and one without a Stribeck term."""
    frictions = (
        JointFriction(2.0, -0.3, 0.5, 1e-05, 500.0, 10.0),
        JointFriction(0.1 + 0.2, 0.0, 1.0 / 3.0, -3.16, 123.456789012345678),
        JointFriction(20.39, 5e-324, 203.5, -0.0, 1e16, 1e-3),
    )
    types = (JointType.REVOLUTE, JointType.REVOLUTE, JointType.PRISMATIC)
    units = DriveUnits(-0.0015, 0.032, ("mA: torque_constant 1.5 Nm/A, sign -1",))
    joints = tuple(JointCompensation(*row, units) for row in zip(names, types, frictions, strict=True))
    source = RecordingSource("run 1.csv", "0f" * 32)
    return CompensationModel(robot, joints, date(2026, 11, 21), (source,), "0.1.0")


def friction_torque(friction: JointFriction, velocity: np.ndarray | float) -> np.ndarray:
    """Equations (7) and (8), and the offset."""
    v = np.asarray(velocity, dtype=np.float64)
    step = np.arctan(friction.k_v * v) * (2.0 / np.pi)
    stribeck = np.arctan((friction.delta or 0.0) * v) * (2.0 / np.pi)
    return friction.stiction * step + friction.stribeck * stribeck + friction.viscous * v + friction.offset


def compiled_table(
    header: str, directory: Path, compiler: str, flags: list[str], suffix: str, name: str
) -> tuple[np.ndarray, list[str]]:
    """Compile the header with warnings as errors and tabulate its functions: torque, mA and ‰ by joint and velocity."""
    (directory / "friction.h").write_text(header, encoding="utf-8")
    grid = ", ".join(repr(float(v)) for v in VELOCITIES)
    (directory / f"main.{suffix}").write_text(
        f"""#include "friction.h"
        #include <stdio.h>
        int main(void) {{
            static const double grid[] = {{{grid}}};
            int joint;
            unsigned k;
            for (joint = 0; joint <= 4; ++joint)
                for (k = 0; k < sizeof grid / sizeof grid[0]; ++k)
                    printf("%.17g %.17g %.17g\\n", {name}_friction_torque(joint, grid[k]),
                           {name}_friction_current_ma(joint, grid[k]), {name}_friction_permille(joint, grid[k]));
            for (joint = 1; joint <= 3; ++joint) {{
                const char *p = {name}_joint_name(joint);
                while (*p) printf("%02x", (unsigned char)*p++);
                printf("\\n");
            }}
            return 0;
        }}"""
    )
    program = directory / f"table_{suffix}"
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    command = [compiler, *flags, *strict, "-O1", str(directory / f"main.{suffix}"), "-o", str(program), "-lm"]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr[:2000]
    lines = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout.splitlines()
    table = np.array([[float(x) for x in line.split()] for line in lines[:-3]]).reshape(5, len(VELOCITIES), 3)
    names = [bytes.fromhex(line).decode("utf-8") for line in lines[-3:]]
    return table, names


@pytest.mark.parametrize(
    ("compiler", "flags", "suffix"), [("gcc", ["-std=c99"], "c"), ("g++", ["-std=c++11"], "cpp"), ("cc", [], "c")]
)
@pytest.mark.parametrize("robot", ["rrr-arm", HOSTILE[0]])
def test_c_header_compiles_clean_and_agrees_with_the_formula(
    tmp_path: Path, compiler: str, flags: list[str], suffix: str, robot: str
):
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler} on this machine")
    written = model(robot, names=(HOSTILE[0], HOSTILE[3], HOSTILE[1]))
    table, names = compiled_table(to_c_header(written), tmp_path, compiler, flags, suffix, identifier(robot))
    assert not table[[0, 4]].any()
    assert names == [joint.name for joint in written.joints]
    for number, joint in enumerate(written.joints, start=1):
        expected = friction_torque(joint.friction, VELOCITIES)
        np.testing.assert_allclose(table[number, :, 0], expected, rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(table[number, :, 1], expected / -0.0015, rtol=2e-15, atol=1e-12)
        np.testing.assert_allclose(table[number, :, 2], expected / 0.032, rtol=2e-15, atol=1e-13)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_neither_break_the_header_nor_change_what_it_computes(tmp_path: Path, name: str):
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on this machine")
    written = model(name, names=(name, f"{name}2", f"{name}3"))
    table, names = compiled_table(to_c_header(written), tmp_path, "gcc", ["-std=c99"], "c", identifier(name))
    assert names == [joint.name.replace("\0", "\ufffd") for joint in written.joints]
    expected = friction_torque(written.joints[0].friction, VELOCITIES)
    np.testing.assert_allclose(table[1, :, 0], expected, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("name", HOSTILE)
def test_python_module_computes_the_formula(name: str):
    written = model(name, names=(name, "b", "c"))
    space: dict = {}
    exec(compile(to_python(written), "friction.py", "exec"), space)
    assert space["JOINT_NAMES"] == (name, "b", "c")
    for number, joint in enumerate(written.joints, start=1):
        torque = [space[f"{identifier(name)}_friction_torque"](number, v) for v in VELOCITIES]
        current = [space[f"{identifier(name)}_friction_current_ma"](number, v) for v in VELOCITIES]
        np.testing.assert_allclose(torque, friction_torque(joint.friction, VELOCITIES), rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(current, np.array(torque) / -0.0015, rtol=1e-15)
    for number in (0, 4):
        with pytest.raises(IndexError, match="numbered 1 to 3"):
            space[f"{identifier(name)}_friction_torque"](number, 1.0)


def test_formula_against_hand_values():
    friction = JointFriction(2.0, -0.3, 0.5, 0.1, 500.0, 10.0)
    assert friction_torque(friction, 0.0) == pytest.approx(0.1)
    assert friction_torque(friction, 0.002) == pytest.approx(1.0 - 0.6 / math.pi * math.atan(0.02) + 0.001 + 0.1)
    assert friction_torque(friction, 1e9) == pytest.approx(1.7 + 0.5e9 + 0.1)
    assert friction_torque(friction, -0.1) == pytest.approx(0.2 - friction_torque(friction, 0.1))


@pytest.mark.parametrize("name", HOSTILE)
def test_json_and_yaml_read_back_equal(name: str):
    written = model(name, names=(name, "off", "1e3"))
    document = to_document(written)
    assert json.loads(to_json(written)) == document
    assert YAML(typ="safe", pure=True).load(to_yaml(written)) == document
    older = YAML(typ="safe", pure=True)
    older.version = (1, 1)
    assert older.load(to_yaml(written)) == document
    assert document["joints"][0]["torque"]["stribeck"] == -0.3
    assert document["joints"][0]["current"]["stiction"] == 2.0 / -0.0015
    assert document["joints"][1]["delta"] is None
    assert document["joints"][2]["torque"]["unit"] == "N"
    assert document["recordings"] == [{"name": "run 1.csv", "sha256": "0f" * 32}]


@given(st.text(max_size=40))
def test_any_name_is_harmless(name: str):
    word = identifier(name)
    assert word.isidentifier()
    assert word.isascii()
    assert word[0].isalpha()
    assert set(comment_text(name)).isdisjoint('*?"\\\n\r')
    assert c_string(name).count('"') == 2
    assert "\n" not in c_string(name)


def test_units_that_are_not_known_are_said_and_not_invented():
    known = drive_units(Joint("a", torque_constant=1.5, sign=-1), EffortKind.CURRENT)
    unknown = drive_units(Joint("b"), EffortKind.TORQUE)
    assert known.torque_per_milliampere == -0.0015
    assert known.torque_per_permille is None
    assert unknown == DriveUnits(None, None, unknown.remarks)
    assert "mA not known" in unknown.remarks[0]
    assert "drive.rated_torque_nm" in unknown.remarks[1]
    friction = JointFriction(1.0, 0.0, 0.1, 0.0, 100.0)
    joints = tuple(
        JointCompensation(name, JointType.REVOLUTE, friction, units) for name, units in (("a", known), ("b", unknown))
    )
    mixed = CompensationModel("two", joints, date(2026, 11, 21), (), "0.1.0")
    for text in (to_c_header(mixed), to_python(mixed)):
        assert "two_friction_current_ma" not in text
        assert "two_friction_permille" not in text
        assert "not known for b" in text.replace("\n * ", " ").replace("\n# ", " ")
    assert to_document(mixed)["joints"][1]["current"] is None
    assert to_document(mixed)["joints"][1]["rated_torque"] is None


def test_current_without_a_torque_constant_is_remarked_on():
    units = drive_units(Joint("a"), EffortKind.CURRENT)
    assert units.torque_per_milliampere == 0.001
    assert "in A, not in Nm" in units.remarks[0]


def test_rated_torque_counts_at_the_motor_shaft():
    joint = Joint("a", gear_ratio=100.0, sign=-1, drive={"rated_torque_nm": 0.32})
    assert drive_units(joint, EffortKind.TORQUE).torque_per_permille == pytest.approx(-0.032)
    direct = Joint("a", drive={"rated_torque_nm": 40})
    assert drive_units(direct, EffortKind.TORQUE).torque_per_permille == pytest.approx(0.04)
    assert "no gear_ratio is stated" in drive_units(direct, EffortKind.TORQUE).remarks[1]
    slide = Joint("a", JointType.PRISMATIC, gear_ratio=100.0, drive={"rated_torque_nm": 0.32})
    assert drive_units(slide, EffortKind.TORQUE).torque_per_permille is None


@pytest.mark.parametrize("rated", ["0.32", True, 0.0, -1.0, math.inf, math.nan, [1.0]])
def test_rated_torque_that_is_no_positive_number_is_refused(rated: object):
    joint = Joint("elbow", drive={"rated_torque_nm": rated})
    with pytest.raises(ExportError, match=r"joint 'elbow': drive.rated_torque_nm"):
        drive_units(joint, EffortKind.TORQUE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"viscous": math.nan}, "joint 'elbow': viscous is not finite"),
        ({"k_v": math.inf}, "joint 'elbow': k_v is not finite"),
        ({"k_v": 0.0}, "joint 'elbow': k_v = 0 is not positive"),
        ({"delta": None}, "joint 'elbow': has a Stribeck term but no delta"),
        ({"delta": -1.0}, "joint 'elbow': delta = -1 is not positive"),
    ],
)
def test_coefficients_that_no_controller_can_use_are_refused(change: dict, message: str):
    values = {"stiction": 1.0, "stribeck": -0.1, "viscous": 0.1, "offset": 0.0, "k_v": 100.0, "delta": 10.0} | change
    joint = JointCompensation("elbow", JointType.REVOLUTE, JointFriction(**values))
    with pytest.raises(ExportError, match=message):
        CompensationModel("arm", (joint,), date(2026, 11, 21), (), "0.1.0")
    with pytest.raises(ExportError, match="no joints"):
        CompensationModel("arm", (), date(2026, 11, 21), (), "0.1.0")
