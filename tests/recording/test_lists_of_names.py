"""Lists that name their joints are matched by these names, whatever holds them, and never by place."""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from recording.layout_files import JOINTS, TAU, TIME, Q, guess_of, read
from recording.recording_files import message_of, rows_of
from tauscope.recording import read_recording
from tauscope.robot import RecordingLayout

Lists = tuple[list[str], np.ndarray, np.ndarray]


def write_npz(path: Path, lists: Lists) -> None:
    names, q, tau = lists
    np.savez(path, time=TIME, joint_names=np.array(names), q=q, tau=tau.T)


def write_matlab(path: Path, lists: Lists) -> None:
    names, q, tau = lists
    savemat(path, {"log": {"time": TIME, "names": np.array(names, dtype=object), "q": q, "tau": tau}})


def write_json(path: Path, lists: Lists) -> None:
    names, q, tau = lists
    path.write_text(json.dumps({"time": TIME.tolist(), "names": names, "q": q.tolist(), "tau": tau.tolist()}))


def write_cells(brackets: str) -> Callable[[Path, Lists], None]:
    def cell(values: list) -> str:
        return '"' + brackets[0] + ", ".join(map(repr, values)) + brackets[1] + '"'

    def write(path: Path, lists: Lists) -> None:
        names, *numbers = lists
        rows = [
            [repr(float(t)), cell(names), *(cell(each[k].tolist()) for each in numbers)] for k, t in enumerate(TIME)
        ]
        path.write_text("\n".join(["time,.name,.position,.effort", *map(",".join, rows)]) + "\n")

    return write


def write_parquet(path: Path, lists: Lists) -> None:
    import pyarrow
    import pyarrow.parquet

    names, q, tau = lists
    columns = {"time": TIME, "name": [names] * len(TIME), "position": q.tolist(), "effort": tau.tolist()}
    pyarrow.parquet.write_table(pyarrow.table(columns), path)


WRITERS = {
    "npz": write_npz,
    "mat": write_matlab,
    "json": write_json,
    "csv": write_cells("[]"),
    "tuples.csv": write_cells("()"),
    "parquet": write_parquet,
}


@pytest.mark.parametrize("kind", WRITERS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=6)
@given(order=st.permutations(range(3)))
def test_joints_are_matched_by_the_list_that_names_them(tmp_path: Path, kind: str, order: list[int]) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"log.{kind}"
    WRITERS[kind](path, ([JOINTS[k] for k in order], Q[:, order], TAU[:, order]))
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert isinstance(guess.columns, Mapping)
    assert np.array_equal(rows_of(read(path, guess, JOINTS)), np.column_stack([TIME, Q, TAU]))
    plain = {target: re.sub(r"\[.*", "", str(source)) for target, source in guess.columns.items()}
    named = read(path, RecordingLayout(columns=plain), JOINTS)
    assert np.array_equal(rows_of(named), np.column_stack([TIME, Q, TAU]))
    assert "the robot has 3 (a, b, c)" in message_of(lambda: read(path, guess, ("a", "b", "c")))
