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


SHAPES = {
    "a sample a column": {"time": TIME, "q": Q.T, "tau": TAU.T},
    "gains and limits beside": {
        "time": TIME,
        "q": Q,
        "tau": TAU.T,
        **dict.fromkeys(("kp", "kd", "low", "high"), [1.0] * 3),
    },
    "one environment of several": {"time": TIME, "q": Q[:, None], "tau": TAU[:, None]},
    "samples last, as Simulink has them": {"tout": TIME, "q": Q.T[:, None], "tau": TAU.T[:, None]},
    "a column of time": {"time": TIME[:, None], "q": Q, "tau": TAU},
}


@pytest.mark.parametrize("name", SHAPES)
def test_arrays_may_have_any_axis_of_samples(tmp_path: Path, name: str) -> None:
    arrays = {key: np.asarray(array) for key, array in SHAPES[name].items()}
    np.savez(tmp_path / "log.npz", **arrays, allow_pickle=False)
    guess = guess_of(message_of(lambda: read_recording(tmp_path / "log.npz", joint_names=JOINTS)))
    assert np.array_equal(rows_of(read(tmp_path / "log.npz", guess, JOINTS)), ROWS)


@pytest.mark.parametrize("is_wide", [True, False])
@pytest.mark.parametrize("suffix", [".npy", ".npz", ".mat", ".json"])
def test_a_matrix_alone_has_numbered_columns(tmp_path: Path, suffix: str, is_wide: bool) -> None:
    path, matrix = tmp_path / f"log{suffix}", ROWS.T if is_wide else ROWS
    if suffix == ".npy":
        np.save(path, matrix)
    elif suffix == ".npz":
        np.savez(path, data=matrix)
    elif suffix == ".mat":
        savemat(path, {"data": matrix})
    else:
        path.write_text(json.dumps(matrix.tolist()), encoding="utf-8")
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert guess.columns == {"t": 1, "q": [2, 3, 4], "tau": [5, 6, 7]}
    assert np.array_equal(rows_of(read(path, guess, JOINTS)), ROWS)


def test_names_of_columns_beside_a_matrix_or_in_it(tmp_path: Path) -> None:
    names = ["t", "q1", "q2", "q3", "tau1", "tau2", "tau3"]
    np.savez(tmp_path / "log.npz", data=ROWS, columns=np.array(names))
    np.save(tmp_path / "log.npy", np.array([*map(tuple, ROWS)], dtype=[(name, float) for name in names]))
    frame = {
        name: {str(row): value for row, value in enumerate(column)} for name, column in zip(names, ROWS.T, strict=True)
    }
    (tmp_path / "log.json").write_text(json.dumps(frame), encoding="utf-8")  # as pandas writes a table
    for file in ("log.npz", "log.npy", "log.json"):
        assert np.array_equal(rows_of(read_recording(tmp_path / file)), ROWS)


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
