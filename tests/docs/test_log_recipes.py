"""Every recipe for the log of another tool is run on a log of that kind."""

import json
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from ruamel.yaml import YAML

from cli.simulated_files import write_files
from recording.recording_files import joint_state, write_log
from shared_data import REPOSITORY
from tauscope.cli import main
from tauscope.recording import open_recording
from tauscope.robot import layout_from_dict, read_robot

PAGE = (REPOSITORY / "docs" / "how-to" / "read-a-log-of-another-tool.md").read_text(encoding="utf-8")
SECTIONS = dict(section.split("\n", 1) for section in PAGE.split("\n## ")[1:])
NAMES = ("joint1", "joint2", "joint3")
AMPERE_NM = 2.0

MJCF = """<mujoco><option gravity="0 -9.81 0" timestep="0.002"/><worldbody>
<body><joint name="a" type="hinge" axis="0 0 1" damping="0.3"/><inertial pos="0.3 0 0" mass="2" diaginertia=".1 .1 .1"/>
<body pos="0.5 0 0"><joint name="b" type="hinge" axis="0 0 1" damping="0.2"/>
<inertial pos="0.2 0 0" mass="1" diaginertia=".05 .05 .05"/></body></body></worldbody>
<actuator><motor joint="a"/><motor joint="b"/></actuator></mujoco>"""
MUJOCO_ROBOT = """name: planar
kinematics: {dh: [{theta: 0, d: 0, a: 0.5, alpha: 0}, {theta: 0, d: 0, a: 0.4, alpha: 0}]}
gravity: [0, -9.81, 0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The simulated arm's robot file, with torque constants, and its recording as every tool would log it."""
    folder = tmp_path_factory.mktemp("logs")
    files = write_files(folder)
    robot = files.robot.read_text(encoding="utf-8")
    constants = robot.replace("- name: joint", f"- torque_constant: {AMPERE_NM}\n  name: joint")
    (folder / "robot.yaml").write_text(constants, encoding="utf-8")
    samples = open_recording(files.train[0], read_robot(files.robot)).samples()
    t, q, tau = samples.time, samples.position, samples.effort
    qd = np.gradient(q, t, axis=0)
    degrees, amperes = np.degrees(q), tau / AMPERE_NM
    table(
        folder / "ur.csv", {"timestamp": t, "actual_q_{0}": q, "actual_qd_{0}": qd, "actual_current_{0}": amperes}, " "
    )
    table(
        folder / "franka.csv",
        {"time": t, "q[{0}]": q, "dq[{0}]": qd, "tau_J[{0}]": tau, "tau_ext_hat_filtered[{0}]": q},
    )
    table(
        folder / "fri.csv",
        {"time": t, "MeasuredTorque_A{1}": tau, "ExternalTorque_A{1}": q, "MeasuredPosition_A{1}": q},
    )
    table(
        folder / "dynamixel.csv",
        {"time": t, "ID{1}_Present_Position": degrees, "ID{1}_Present_Current": 1e3 * amperes},
    )
    table(
        folder / "isaac.csv",
        {"time": t, "joint_pos[{name}]": q, "joint_vel[{name}]": qd, "applied_torque[{name}]": tau},
    )
    table(folder / "sound.csv", {"t": t, "q{1}": q, "tau{1}": tau})
    topic = "/joint_states/{name}/"
    table(folder / "plotjuggler.csv", {"__time": t, f"{topic}position": q, f"{topic}effort": tau})
    table(folder / "other.txt", {"": np.column_stack([t, q, tau])}, " ", header=False)
    write_bag(folder / "bag", t, q, tau)
    write_bag(folder / "bag-of-currents", t, q, amperes)
    write_lerobot(folder / "data" / "chunk-000" / "file-000.parquet", t, degrees, amperes)
    (folder / "mujoco-robot.yaml").write_text(MUJOCO_ROBOT, encoding="utf-8")
    return folder


def table(path: Path, columns: Mapping[str, np.ndarray], delimiter: str = ",", *, header: bool = True) -> None:
    names: list[str] = []
    for template, values in columns.items():
        joints = range(1 if values.ndim == 1 else 3)
        marks = ({"{0}": str(k), "{1}": str(k + 1), "{name}": NAMES[k]} for k in joints)
        names += [re.sub(r"\{(0|1|name)\}", lambda match, mark=mark: mark[match[0]], template) for mark in marks]
    rows = np.column_stack(list(columns.values())).tolist()
    lines = [delimiter.join(map(repr, row)) for row in rows]
    path.write_text("\n".join([delimiter.join(names), *lines] if header else lines) + "\n", encoding="utf-8")


def write_bag(folder: Path, t: np.ndarray, q: np.ndarray, effort: np.ndarray) -> None:
    folder.mkdir()
    stamps = (10**18 + np.round(t * 1e9)).astype(np.int64).tolist()
    log = [(n, joint_state(n, p, e, (), NAMES)) for n, p, e in zip(stamps, q.tolist(), effort.tolist(), strict=True)]
    write_log(folder / "bag_0.mcap", {"/joint_states": log})
    text = "rosbag2_bagfile_information: {relative_file_paths: [bag_0.mcap]}\n"
    (folder / "metadata.yaml").write_text(text, encoding="utf-8")


def write_lerobot(path: Path, t: np.ndarray, q: np.ndarray, current: np.ndarray) -> None:
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path.parent.mkdir(parents=True)
    columns = {"observation.state": q.tolist(), "action": q.tolist(), "observation.current": current.tolist()}
    episode = np.zeros(len(t), dtype=np.int64)
    parquet.write_table(arrow.table({**columns, "timestamp": t, "episode_index": episode}), path)


def commands(section: str) -> Sequence[Sequence[str]]:
    blocks = re.findall(r"^```sh\n(.*?)^```$", SECTIONS[section], flags=re.MULTILINE | re.DOTALL)
    return [shlex.split(line) for block in blocks for line in block.splitlines()]


@pytest.fixture(scope="module")
def sound_error(folder: Path) -> float:
    return error_of(["identify", str(folder / "robot.yaml"), str(folder / "sound.csv")], folder)


def error_of(words: Sequence[str], folder: Path) -> float:
    assert main([*words, "--json", str(folder / "result.json")]) == 0
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))["fit"]["train"]["relative_error"]


@pytest.mark.parametrize("section", [section for section in SECTIONS if section != "MuJoCo"])
def test_a_recipe_works(section: str, folder: Path, sound_error: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert commands(section)
    for program, *words in commands(section):
        assert program == "tauscope"
        if words[0] == "identify":
            assert error_of(words, folder) == pytest.approx(sound_error, rel=1e-3)
        else:
            assert main(words) == 0


def test_the_recipe_of_mujoco_works(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mujoco: ModuleType = pytest.importorskip("mujoco")
    monkeypatch.chdir(folder)
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)

    def controller(data: object) -> np.ndarray:
        del data
        target = np.array([np.sin(1.7 * now()) + 0.5 * np.sin(4.1 * now()), np.sin(2.3 * now())])
        return 60.0 * (target - state.qpos) - 6.0 * state.qvel

    state = data
    now: Callable[[], float] = lambda: state.time  # noqa: E731
    (code,) = re.findall(r"^```python\n(.*?)^```$", SECTIONS["MuJoCo"], flags=re.MULTILINE | re.DOTALL)
    exec(compile(code, "recipe", "exec"), {"mujoco": mujoco, "model": model, "data": data, "controller": controller})
    ((_, *words),) = commands("MuJoCo")
    assert error_of(words, folder) < 0.01


def test_the_mapping_that_is_written_by_hand_is_sound() -> None:
    (text,) = re.findall(r"^```yaml\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    layout = layout_from_dict(YAML(typ="safe").load(text))
    assert layout.units == {"t": "ms", "q": "deg"}
    assert layout.decimal == ","
