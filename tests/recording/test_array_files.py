"""Archives of NumPy and MATLAB, and JSON, give the recording whose arrays or objects they hold."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from recording.layout_files import JOINTS, QD, TAU, TIME, Q, guess_of, read
from recording.recording_files import message_of, rows_of
from tauscope.recording import read_recording
from tauscope.robot import read_layout

ROWS = np.column_stack([TIME, Q, TAU])


@pytest.mark.parametrize("saves", [np.savez, np.savez_compressed])
def test_numpy_archives(tmp_path: Path, saves: Callable[..., None]) -> None:
    path = tmp_path / "log.npz"
    saves(path, time=TIME, qpos=Q, qvel=QD, qfrc_actuator=TAU, name=np.array("arm"), gains=np.ones(3))
    recording = read(path, read_layout("mujoco"), JOINTS)
    assert np.array_equal(rows_of(recording), np.column_stack([TIME, Q, TAU, QD]))
    assert guess_of(message_of(lambda: read_recording(path))).columns == {
        "t": "time",
        "q": "qpos[{0}]",
        "tau": "qfrc_actuator[{0}]",
        "qd": "qvel[{0}]",
    }
    path.write_bytes(path.read_bytes()[:-300])
    assert "not a readable NumPy archive" in message_of(lambda: read(path, read_layout("mujoco")))
    np.savez(path, words=np.array(["a"]))
    assert "no array holds a row a sample" in message_of(lambda: read(path, read_layout("mujoco")))
    np.savez(path, time=np.array([object()]))
    assert "not a readable NumPy archive" in message_of(lambda: read(path, read_layout("mujoco")))


@pytest.mark.parametrize("is_compressed", [True, False])
def test_matlab_files(tmp_path: Path, is_compressed: bool) -> None:
    path = tmp_path / "log.mat"
    log = {"q": Q, "tau": TAU.T, "label": "bench"}
    savemat(path, {"time": TIME[:, None], "log": log, "kp": 3.0}, do_compression=is_compressed)
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert guess.columns == {"t": "time", "q": "log.q[{0}]", "tau": "log.tau[{0}]"}
    assert np.array_equal(rows_of(read(path, guess, JOINTS)), ROWS)
    path.write_bytes(path.read_bytes()[:-300])
    assert "not a readable MATLAB file" in message_of(lambda: read(path, guess, JOINTS))
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    assert "save it by save(..., '-v7')" in message_of(lambda: read(path, guess, JOINTS))


def write_json(path: Path, kind: str) -> None:
    lists = {"stamp": TIME.tolist(), "position": Q.tolist(), "effort": TAU.tolist(), "frame": ["base"] * len(TIME)}
    records = [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]
    content = {"lists": lists, "lists in an object": {"arm": "bench", "log": lists}, "records": {"samples": records}}
    lines = [json.dumps(record) for record in records]
    text = "\n".join(lines) if kind == "lines" else json.dumps(content.get(kind, records), indent=1)
    path.write_text(text + "\n", encoding="utf-8")


@pytest.mark.parametrize("kind", ["lines", "a list", "records", "lists", "lists in an object"])
def test_json(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "log.json"
    write_json(path, kind)
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert np.array_equal(rows_of(read(path, guess, JOINTS)), ROWS)


def test_joints_that_json_names_go_by_name(tmp_path: Path) -> None:
    orders = [[0, 1, 2], [2, 0, 1]]  # messages differ
    lines = []
    for k, time in enumerate(TIME.tolist()):
        order = orders[k % 2]
        names, q, tau = ([values[joint] for joint in order] for values in (JOINTS, Q[k].tolist(), TAU[k].tolist()))
        stamp = {"sec": int(time), "nanosec": round(time % 1 * 1e9)}
        lines.append(json.dumps({"header": {"stamp": stamp}, "name": names, "position": q, "effort": tau}))
    path = tmp_path / "echo.jsonl"
    path.write_text("\n".join(lines), encoding="utf-8")
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    recording = read(path, guess, JOINTS)
    assert np.array_equal(recording.samples().position, Q)
    assert np.array_equal(recording.samples().effort, TAU)
    assert np.allclose(np.diff(recording.samples().time), 0.01, atol=1e-9)


def test_what_is_no_whole_json_is_refused_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    write_json(path, "lines")
    path.write_bytes(path.read_bytes()[:-20])
    assert f"line {len(TIME)} is no whole JSON object" in message_of(lambda: read_recording(path))
    path.write_bytes(b'{"a": [' + b"[" * 5000)
    assert "not a readable JSON file" in message_of(lambda: read_recording(path))
    path.write_text('{"arm": "bench"}', encoding="utf-8")
    assert "no array holds a row a sample" in message_of(lambda: read_recording(path))
