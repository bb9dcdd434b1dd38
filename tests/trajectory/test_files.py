"""Trajectory files: what is written reads back, what is damaged is named in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from excitation.excited_arms import limited_paper_arm, resting_series
from tauscope.errors import ExcitationError
from tauscope.excitation import require_within_limits
from tauscope.trajectory import (
    FourierSegment,
    Trajectory,
    motion_limits,
    parse_trajectory_json,
    read_trajectory,
    trajectory_json,
    write_trajectory,
)
from tauscope.trajectory.csv_format import parse_trajectory_csv, trajectory_csv
from tauscope.trajectory.trajectory import DesignRecord
from trajectory.test_trajectory import whole_trajectory

ROBOT = limited_paper_arm()
NAMES = ("joint1", "joint2", "joint3")


def described_trajectory() -> Trajectory:
    """One with all that a file may hold."""
    plain = whole_trajectory()
    record = DesignRecord(
        criterion="cond-f",
        value=12345.678901234567,
        condition_number=1.0 / 3.0,
        margins={"position": [0.1, None, 0.3]},
        seed=7,
    )
    return Trajectory("paper", NAMES, plain.segments, motion_limits(limited_paper_arm(torque=None)), record)


def test_json_reads_back_to_the_last_digit(tmp_path: Path) -> None:
    trajectory = described_trajectory()
    path = tmp_path / "motion.json"
    write_trajectory(trajectory, path)
    read = read_trajectory(path, ROBOT)
    assert trajectory_json(read) == path.read_text()
    for rate in (100.0, 333.0):
        mine, other = trajectory.samples(rate), read.samples(rate)
        for name in ("time", "position", "velocity", "acceleration", "period"):
            assert np.array_equal(getattr(mine, name), getattr(other, name), equal_nan=True)
    assert read.design == trajectory.design
    assert read.limits is not None
    assert np.isinf(read.limits.torque).all()


def test_csv_reads_back_and_json_keeps_it(tmp_path: Path) -> None:
    trajectory = whole_trajectory()
    path = tmp_path / "motion.csv"
    write_trajectory(trajectory, path, rate_hz=200.0)
    read = read_trajectory(path, ROBOT)
    mine, other = trajectory.samples(200.0), read.samples(200.0)
    for name in ("time", "position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(mine, name), getattr(other, name), atol=1e-12)
    assert np.array_equal(mine.period, other.period, equal_nan=True)
    again = parse_trajectory_json(trajectory_json(read), "again.json", ROBOT)
    assert np.array_equal(again.samples(150.0).position, read.samples(150.0).position)


def test_positions_alone_can_be_played() -> None:
    series = resting_series(np.random.default_rng(4), 3)
    time = np.arange(0.0, 10.0 + 1e-9, 0.01)
    exact = series.evaluate(time)
    rows = np.column_stack([time, exact.position])
    text = "t,q1,q2,q3\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    read = parse_trajectory_csv(text, "motion.csv", "paper", NAMES).samples(100.0)
    np.testing.assert_allclose(read.velocity, exact.velocity, atol=1e-6)
    np.testing.assert_allclose(read.acceleration, exact.acceleration, atol=1e-4)


def test_a_fast_motion_from_a_file_is_refused_by_the_limits() -> None:
    time = np.linspace(0.0, 1.0, 101)
    step = 2.5 * (10 * time**3 - 15 * time**4 + 6 * time**5)
    rows = np.column_stack([time, step, 0.0 * step, 0.0 * step])
    text = "t,q1,q2,q3\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    trajectory = parse_trajectory_csv(text, "fast.csv", "paper", NAMES)
    with pytest.raises(ExcitationError, match=r"fast\.csv: joint1: velocity is 4\.68\d* rad/s at 0\.500 s"):
        require_within_limits(trajectory, ROBOT, motion_limits(ROBOT), "fast.csv")
    inside = Trajectory("paper", NAMES, (FourierSegment(resting_series(np.random.default_rng(0), 3)),))
    require_within_limits(inside, ROBOT, motion_limits(ROBOT))


SOUND = "t,q1,q2,q3\n" + "\n".join(f"{0.1 * k:.1f},0,0,0" for k in range(20))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no header"),
        ("t,q1,q2\n0,0,0\n1,0,0\n", "column q3 is missing"),
        ("q1,q2,q3\n0,0,0\n", "column t is missing"),
        ("t,q1,q2,q3,q4\n0,0,0,0,0\n1,0,0,0,0\n", "q4 belongs to no joint"),
        ("t,q1,q2,q3,tau1\n0,0,0,0,0\n", "unknown column 'tau1'"),
        ("t,q1,q2,q3,q1\n0,0,0,0,0\n", "q1 is there twice"),
        (SOUND.replace("0.3,0,0,0", "0.3,0,0"), "line 5 has 3 fields where the header has 4"),
        (SOUND.replace("0.3,0,0,0", "0.3,0,x,0"), "line 5, column q2: 'x' is no finite number"),
        (SOUND.replace("0.3,0,0,0", "0.3,0,nan,0"), "line 5, column q2: 'nan' is no finite number"),
        (SOUND.replace("0.3,0,0,0", "0.2,0,0,0"), "line 5, column t: time does not increase"),
        ("t,q1,q2,q3\n0,0,0,0\n", "has 1 rows"),
        ("t,q1,q2,q3\n0,0,0,0\n1,0,0,0\n", "need 6"),
        ("t,q1,q2,q3,qd1\n0,0,0,0,0\n1,0,0,0,0\n", "column qd2 is missing"),
        (
            "t,q1,q2,q3,qd1,qd2,qd3\n" + "\n".join(f"{0.1 * k:.1f},{0.1 * k:.1f},0,0,57.3,0,0" for k in range(9)),
            "line 3, column qd1: 57.3 does not fit the positions, whose slope is 1",
        ),
    ],
)
def test_csv_faults_are_named(text: str, message: str) -> None:
    with pytest.raises(ExcitationError) as raised:
        parse_trajectory_csv(text, "motion.csv", "paper", NAMES)
    assert str(raised.value).startswith("motion.csv: ")
    assert message in str(raised.value)


def edited(edit: str, value: object) -> str:
    """The JSON document with one key replaced, ``segments.0.cosine`` for example."""
    document = json.loads(trajectory_json(described_trajectory()))
    *way, last = edit.split(".")
    place = document
    for key in way:
        place = place[int(key)] if key.isdigit() else place[key]
    place[last] = value
    return json.dumps(document)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("schema", "tauscope.trajectory/2", "schema: input should be 'tauscope.trajectory/1'"),
        ("segments.0.kind", "spline", "segments[0]"),
        ("segments.0.cosine", [[0.0]] * 2, "segments[0].cosine: has 2 entries where 3 are expected"),
        ("segments.0.sine", [[0.0] * 4] * 3, "segments[0].sine[0]: has 4 numbers where 5 are expected"),
        ("segments.0.period_s", -1.0, "segments[0].period_s: input should be greater than 0"),
        ("segments.0.repeats", 1.5, "segments[0].repeats"),
        ("segments.0.speed", 1.0, "segments[0].speed: extra inputs"),
        ("segments.2.start", [0.0, "a", 0.0], "segments[2].start[1]"),
        ("segments.2.end", [9.0, 0.0, 0.0], "segments[3], joint1: begins"),
        ("segments.1.series.centre", [0.0], "segments[1].series.centre: has 1 entries"),
        ("limits.velocity", [1.0], "limits.velocity: has 1 entries where 3 are expected"),
        ("joints", ["a", "b"], "joints: the trajectory moves 2 joints, robot 'paper' has 3"),
        ("segments", [], "segments: list should have at least 1 item"),
    ],
)
def test_json_faults_are_named(key: str, value: object, message: str) -> None:
    with pytest.raises(ExcitationError) as raised:
        parse_trajectory_json(edited(key, value), "motion.json", ROBOT)
    assert str(raised.value).startswith("motion.json: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(ExcitationError, match="no such file"):
        read_trajectory(tmp_path / "absent.json", ROBOT)
    with pytest.raises(ExcitationError, match="is a directory"):
        read_trajectory(tmp_path, ROBOT)
    with pytest.raises(ExcitationError, match=r"ends in \.json or \.csv"):
        write_trajectory(whole_trajectory(), tmp_path / "motion.txt")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ExcitationError, match="not UTF-8"):
        read_trajectory(tmp_path / "binary.json", ROBOT)


JSON_TEXT = trajectory_json(described_trajectory())
CSV_TEXT = trajectory_csv(whole_trajectory(), 5.0)


def designed(**changes: object) -> str:
    """An excitation's document, as ``excite --json`` writes it, with some of its members replaced."""
    document = {
        "schema": "tauscope.excitation/1",
        "robot": "paper",
        "joints": NAMES,
        "criterion": "cond-f",
        "value": 12.5,
        "condition_number": 3.5,
        "random_value": 80.0,
        "period_s": 10.0,
        "harmonics": 5,
        "periods": 2,
        "duration_s": 25.0,
        "margins": {"position": [0.1, None, 0.3]},
        "clearance_m": None,
        "active": ["joint1: velocity"],
        "notes": [],
        "evaluations": 100,
        "seconds": 1.5,
        "history": [{"start": 1, "iteration": 1, "value": 2.5, "violation": 0.0}],
        "trajectory": json.loads(JSON_TEXT),
    }
    return json.dumps(document | changes)


def test_an_excitation_holds_the_trajectory_that_is_played(tmp_path: Path) -> None:
    path = tmp_path / "design.json"
    path.write_text(designed())
    assert trajectory_json(read_trajectory(path, ROBOT)) == JSON_TEXT


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": 1.0}, "speed: extra inputs are not permitted (it is 1.0)"),
        ({"periods": "2"}, "periods: input should be a valid integer (it is '2')"),
        ({"criterion": "cond-3"}, "criterion: input should be 'cond-f', 'log-det' or 'cond-2' (it is 'cond-3')"),
        ({"margins": {"position": [0.1, "a"]}}, "margins.position[1]: input should be a valid number (it is 'a')"),
        ({"history": [{"start": 1, "iteration": 1, "value": 2.5}]}, "history[0].violation: field required"),
        ({"trajectory": {}}, "trajectory.robot: field required"),
    ],
)
def test_faults_of_an_excitation_are_named(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    path = tmp_path / "design.json"
    path.write_text(designed(**changes))
    with pytest.raises(ExcitationError) as raised:
        read_trajectory(path, ROBOT)
    assert str(raised.value) == f"{path}: {message}"


@settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_mutated_files_never_make_a_traceback(data: st.DataObject) -> None:
    is_json = data.draw(st.booleans())
    text = JSON_TEXT if is_json else CSV_TEXT
    for _ in range(data.draw(st.integers(1, 4))):
        begin = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(begin, min(len(text), begin + 40)))
        text = text[:begin] + data.draw(st.text(alphabet='0123456789.,-eE[]{}":\n nullq\x00é', max_size=8)) + text[end:]
    message = ""
    try:
        if is_json:
            parse_trajectory_json(text, "motion.json", ROBOT)
        else:
            parse_trajectory_csv(text, "motion.csv", "paper", NAMES)
    except ExcitationError as error:  # anything else is a fault
        message = str(error)
    assert "\n" not in message
