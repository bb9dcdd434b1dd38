"""Logs of which no message holds all joints, or both position and effort."""

from pathlib import Path

import numpy as np
import pytest

from recording.recording_files import arrays, joint_state, message_of, write_log
from tauscope.recording import read_recording

MOTION = arrays(joints=3)
NAMES = ("a", "b", "c")
STEP_NS, START_NS = 4_000_000, 1_700_000_000_000_000_000
Log = list[tuple[int, dict]]


def part(joints: tuple[int, ...], *, late_ns: int = 0, has: str = "qtv", stamped: bool = True) -> Log:
    """Messages of some joints, with some of position, effort and velocity."""
    columns, log = list(joints), []
    for row in range(len(MOTION["time"])):
        stamp = START_NS + row * STEP_NS + late_ns
        q, tau, qd = (
            MOTION[field][row, columns].tolist() if sign in has else []
            for sign, field in (("q", "position"), ("t", "effort"), ("v", "velocity"))
        )
        log.append((stamp, joint_state(stamp if stamped else 0, q, tau, qd, [NAMES[joint] for joint in joints])))
    return log


@pytest.mark.parametrize(
    "topics",
    [
        {"/joint_states": part((0, 1)) + part((2,))},
        {"/joint_states": part((2, 0), stamped=False) + part((1,), stamped=False)},
        {"/joint_states": part((0,)) + part((1,)) + part((2,))},
        {"/joint_states": part((0, 1, 2), has="q") + part((0, 1, 2), has="tv")},
        {"/left/joint_states": part((0, 1)), "/right/joint_states": part((2,)), "/grip": part((1,), has="q")},
    ],
    ids=["two publishers", "without stamps", "a joint a message", "positions and efforts apart", "two topics"],
)
def test_parts_with_the_same_stamps_are_joined_exactly(tmp_path: Path, topics: dict[str, Log]) -> None:
    recording = read_recording(write_log(tmp_path / "log.mcap", topics), joint_names=NAMES)
    samples = recording.samples()
    for found, field in ((samples.position, "position"), (samples.effort, "effort"), (samples.velocity, "velocity")):
        assert found is not None
        assert np.array_equal(found, MOTION[field])
    assert np.allclose(samples.time, MOTION["time"], atol=1e-12)
    (note,) = recording.notes
    assert note.code == "held-samples"
    assert "merged by name, at the 40 instants of a" in note.text


def test_parts_with_other_stamps_are_interpolated(tmp_path: Path) -> None:
    log = part((0, 1)) + part((2,), late_ns=STEP_NS // 4)
    samples = read_recording(write_log(tmp_path / "log.mcap", {"/joint_states": log}), joint_names=NAMES).samples()
    assert len(samples.time) == 39  # at the first one c is not known yet
    assert np.array_equal(samples.position[:, 0], MOTION["position"][1:, 0])
    before = np.interp(MOTION["time"][1:], MOTION["time"] + 0.001, MOTION["position"][:, 2])
    assert np.allclose(samples.position[:, 2], before, atol=1e-9)


def test_nothing_is_interpolated_across_a_gap(tmp_path: Path) -> None:
    early, late = part((2,)), part((2,), late_ns=STEP_NS // 2)
    del early[20:30], late[20:30]
    log = part((0, 1)) + early + late
    samples = read_recording(write_log(tmp_path / "log.mcap", {"/joint_states": log}), joint_names=NAMES).samples()
    assert np.flatnonzero(np.isnan(samples.position[:, 2])).tolist() == list(range(20, 30))
    assert np.isfinite(samples.position[:, :2]).all()


@pytest.mark.parametrize(
    ("topics", "words"),
    [
        ({"/joint_states": part((0,)) + part((1,))}, "c is missing; record them too"),
        ({"/joint_states": part((0,))}, "b, c are missing; record them too"),
        ({"/state": part((0, 1, 2), has="q"), "/command": part((0, 1, 2), has="t")}, "several topics"),
    ],
)
def test_what_is_nowhere_is_not_made_up(tmp_path: Path, topics: dict[str, Log], words: str) -> None:
    path = write_log(tmp_path / "log.mcap", topics)
    assert words in message_of(lambda: read_recording(path, joint_names=NAMES))
