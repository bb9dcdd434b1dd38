from typing import Any

import numpy as np
import pytest

from recording.recording_files import arrays, message_of
from tauscope.errors import RecordingMismatchError
from tauscope.recording import EffortKind, Recording
from tauscope.robot.robot import Joint, Robot


def recording(**changes: Any):
    arguments: dict[str, Any] = {**arrays(), **changes}
    return Recording.from_arrays("made", **arguments)


def test_columns_come_back_as_views_of_one_table():
    motion = arrays()
    made = recording(period=np.repeat([0.0, 1.0], 20), temperature=np.full((40, 2), 30.0))
    samples = made.samples()
    assert len(made) == 40
    assert made.joint_count == 2
    assert made.table.names == ("t", "q1", "q2", "tau1", "tau2", "qd1", "qd2", "temp1", "temp2", "period")
    for field in ("time", "position", "effort", "velocity"):
        assert np.array_equal(getattr(samples, field), motion[field])
    assert samples.position.base is samples.effort.base
    assert samples.acceleration is None
    assert samples.period is not None
    assert samples.period[-1] == 1
    assert not samples.position.flags.writeable


@pytest.mark.parametrize(("start", "stop"), [(0, None), (3, 7), (0, 0), (39, 1000), (30, 20), (-5, None)])
def test_stretches_follow_the_rules_of_slices(start, stop):
    assert np.array_equal(recording().samples(start, stop).position, arrays()["position"][start:stop])


def test_the_arrays_are_copied():
    motion = arrays()
    made = Recording.from_arrays("made", motion["time"], motion["position"], motion["effort"])
    motion["position"][:] = 0
    assert made.samples().position.any()


def test_lists_and_integers_are_numbers():
    made = Recording.from_arrays("made", list(range(12)), [[k] for k in range(12)], np.zeros((12, 1), dtype=int))  # type: ignore[arg-type]
    assert made.samples().position[11, 0] == 11


@pytest.mark.parametrize(("kind", "gain"), [(EffortKind.TORQUE, [1, -1]), (EffortKind.CURRENT, [0.5, -2])])
def test_joint_torque_has_the_sign_and_where_currents_are_recorded_the_constant(kind, gain):
    robot = Robot("arm", (Joint("a", torque_constant=0.5), Joint("b", torque_constant=2.0, sign=-1)), ())
    made = recording(effort_kind=kind)
    effort = made.samples().effort
    assert np.array_equal(made.joint_torque(effort, robot), effort * gain)
    with pytest.raises(RecordingMismatchError, match="do not fit the robot's 2 joints"):
        made.joint_torque(np.zeros((5, 3)), robot)


def broken(field, row, value, column=None):
    array = arrays()[field]
    array[row if column is None else (row, column)] = value
    return {field: array}


BAD = [
    (broken("time", 7, 0.02), "row 7, column t: time runs backwards: 0.02 s after 0.024 s"),
    (broken("time", 7, 0.024), "row 7, column t: time repeats 0.024 s after 0.024 s"),
    (broken("time", 0, np.nan), "row 0, column t: the time is missing"),
    (broken("time", 39, np.inf), "argument time, row 39: the value is infinite"),
    (broken("position", 3, np.inf, 1), "argument position, row 3, joint 2: the value is infinite"),
    (broken("effort", 3, -np.inf, 0), "argument effort, row 3, joint 1: the value is infinite"),
    ({"effort": np.zeros((40, 3))}, "argument effort has shape (40, 3); expected (40, 2)"),
    ({"position": np.zeros(40)}, "argument position has shape (40,); expected (40, n)"),
    ({"position": np.zeros((40, 0))}, "argument position has shape (40, 0); expected (40, n)"),
    ({"time": np.zeros((40, 1))}, "argument time has shape (40, 1); expected (N)"),
    ({"velocity": np.zeros((39, 2))}, "argument velocity has shape (39, 2); expected (40, 2)"),
    ({"period": np.zeros((40, 1))}, "argument period has shape (40, 1); expected (40)"),
    ({"period": np.full(40, 0.5)}, "row 0, column period: 0.5 is not a whole number"),
    ({"temperature": [["x", "y"]] * 40}, "argument temperature is not an array of numbers"),
    ({"time": None}, "argument time has shape (); expected (N)"),
]


@pytest.mark.parametrize(("changes", "expected"), BAD, ids=[expected for _, expected in BAD])
def test_bad_arrays_are_refused_with_the_place(changes, expected):
    message = message_of(lambda: recording(**changes))
    assert message.startswith("made: ")
    assert expected in message


def test_too_few_samples():
    assert "holds only 9 samples" in message_of(
        lambda: Recording.from_arrays("made", np.arange(9.0), np.zeros((9, 1)), np.zeros((9, 1)))
    )
