"""The examples of the error pages are what Tauscope says: each is provoked, and its page must hold the message."""

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from runtime.doubles import PointArm, connection, point_robot, short_motion
from shared_data import REPOSITORY
from tauscope.errors import AcquisitionError, TauscopeError
from tauscope.excitation import ExcitationOptions, Workspace, design_excitation
from tauscope.export.compensation.model import drive_units
from tauscope.recording import EffortKind, read_recording
from tauscope.robot import Joint, read_robot
from tauscope.runtime.drivers import make_backend
from tauscope.runtime.run import run_trajectory
from tauscope.server.store.data_folder import site_identifier
from tauscope.server.store.database.database import Database
from tauscope.trajectory import read_trajectory

ROBOT = """\
name: two-joints
kinematics:
  dh:
    - {theta: 0.0, d: 0.3, a: 0.0, alpha: 1.5707963}
    - {theta: 0.0, d: 0.0, a: 0.5, alpha: 0.0}
joints:
  - name: joint1
    limits: {position: [-2.9, 2.9]}
  - name: joint2
model:
  links:
    - {mass: 1.4, first_moment: [0, 0, 0], inertia: {xx: 0.1, yy: 0.1, zz: 0.1, xy: 0, xz: 0, yz: 0}}
    - {mass: 1.4, first_moment: [-0.35, 0, 0], inertia: {xx: 0.01, yy: 0.12, zz: 0.12, xy: 0, xz: 0, yz: 0}}
"""
URDF_ROBOT = """\
name: arm
kinematics:
  urdf: {file: arm.urdf, base: base_link, tip: tool1}
"""
URDF = """\
<robot name="arm">
  <link name="base_link"/>
  <link name="tool0"/>
  <joint name="joint1" type="revolute">
    <parent link="base_link"/><child link="tool0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""


def recording(rows: int = 200) -> list[str]:
    """Lines of a sound recording of two joints."""
    return ["t,q1,q2,tau1,tau2", *(f"{0.01 * k:.2f},0.1,0.2,1.5,-0.5" for k in range(rows))]


def spoilt_recording(row: int, line: str) -> str:
    lines = recording()
    lines[row - 1] = line
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("code", "robot"),
    [
        ("robot-file", ROBOT.replace("[-2.9, 2.9]", "[2.9, -2.9]")),
        ("robot-file", ROBOT.replace("position", "postion")),
        ("robot-file", URDF_ROBOT),
    ],
    ids=["limits reversed", "misspelt key", "missing tip"],
)
def test_robot_examples(code: str, robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(robot, encoding="utf-8")
    Path("arm.urdf").write_text(URDF, encoding="utf-8")
    with pytest.raises(TauscopeError) as raised:
        read_robot("arm.yaml")
    assert_on_page(raised.value, code)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("recording", spoilt_recording(57, "0.34,0.1,0.2,1.5,-0.5")),
        ("recording", spoilt_recording(2, "[s],[rad],[rad],[lb],[lb]")),
        ("recording", spoilt_recording(1, "t,q1,tau1,tau2")),
        ("recording", ""),
        ("recording-mismatch", "t,q1,tau1\n" + "".join(f"{k},0.1,1.5\n" for k in range(200))),
    ],
    ids=["time runs backwards", "units row", "missing column", "empty file", "one joint of two"],
)
def test_recording_examples(code: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("log.csv").write_text(text, encoding="utf-8")
    with pytest.raises(TauscopeError) as raised:
        read_recording("log.csv", joint_count=2)
    assert_on_page(raised.value, code)


def test_export_example() -> None:
    joint = Joint("joint2", drive={"rated_torque_nm": 0})
    with pytest.raises(TauscopeError) as raised:
        drive_units(joint, EffortKind.TORQUE)
    assert_on_page(raised.value, "export")


@pytest.mark.parametrize(
    ("robot", "options"),
    [
        (ROBOT.replace("- name: joint2", "- name: joint2\n    limits: {position: [0.3, 0.3005]}"), ExcitationOptions()),
        (ROBOT, ExcitationOptions(workspace=Workspace(floor_m=1.0))),
    ],
    ids=["no room", "floor too high"],
)
def test_design_examples(robot: str, options: ExcitationOptions, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(robot, encoding="utf-8")
    with pytest.raises(TauscopeError) as raised:
        design_excitation(read_robot(path), options)
    assert_on_page(raised.value, "excitation")


@pytest.mark.parametrize("row", ["0.1,0,x", "0.0,0,0"], ids=["no number", "time stands still"])
def test_trajectory_examples(row: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(ROBOT, encoding="utf-8")
    rows = ["t,q1,q2", "0.0,0,0", row] if "x" in row else ["t,q1,q2", "-0.1,0,0", "0.0,0,0", row]
    Path("motion.csv").write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(TauscopeError) as raised:
        read_trajectory("motion.csv", read_robot("arm.yaml"))
    assert_on_page(raised.value, "excitation")


@pytest.mark.parametrize("case", ["outside", "fast", "collision", "silent"])
def test_run_examples(case: str, tmp_path: Path) -> None:
    robot, arm = point_robot(), PointArm(position=np.array([0.4, 2.3 if case == "outside" else -0.3]))
    if case == "collision":
        arm.tamper = lambda arm, state: replace(
            state, position=arm.position - (len(arm.sent) > 100) * np.array([0, 0.25])
        )
    elif case == "silent":
        arm.tamper = lambda arm, state: replace(
            state, position=np.where([len(arm.sent) > 100, False], np.nan, arm.position)
        )
    motion = short_motion(robot, amplitude=0.175 * 2 if case == "fast" else 0.05)
    record = run_trajectory(robot, motion, connection(arm), tmp_path / "run")
    assert record.problem is not None
    assert_on_page(AcquisitionError(record.problem.detail), record.problem.code)


@pytest.mark.parametrize("case", ["damaged", "locked", "newer", "site"])
def test_store_examples(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tauscope.server.store.database.database.TIMEOUT_S", 0.02)
    Path("data").mkdir()
    path = Path("data/tauscope.db")
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        if case == "damaged":
            path.write_bytes(b"no database" * 500)
        elif case == "locked":
            other.execute("BEGIN IMMEDIATE")
        elif case == "newer":
            Database(path).close()
            other.execute("UPDATE alembic_version SET version_num = '9999'")
        else:
            Path("data/site.json").write_bytes(b"{}")
        with pytest.raises(TauscopeError) as raised:
            site_identifier(Path("data")) if case == "site" else Database(path)
    assert_on_page(raised.value, "store")


def test_backend_example() -> None:
    with pytest.raises(AcquisitionError) as raised:
        make_backend("simm", point_robot(), {})
    assert_on_page(raised.value, "acquisition")


def assert_on_page(error: TauscopeError, code: str) -> None:
    page = (REPOSITORY / "docs" / "errors" / f"{code}.md").read_text(encoding="utf-8")
    assert error.code == code
    assert f"\n{error}\n" in page, f"docs/errors/{code}.md does not show:\n{error}"
