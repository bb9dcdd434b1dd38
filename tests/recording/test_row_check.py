import numpy as np

from recording.recording_files import message_of
from tauscope.recording.row_check import RowCheck


def place(row: int) -> str:
    return f"line {row + 2}"


def block(*times: float) -> np.ndarray:
    return np.column_stack([np.array(times), np.zeros((len(times), 2))])


def test_time_rises_from_block_to_block():
    check = RowCheck("file", ("t", "q1", "tau1"))
    check(block(0.0, 0.1), place)
    check(block(), place)
    check(block(0.2), place)
    message = message_of(lambda: check(block(0.2, 0.3), place))
    assert message.startswith("file: line 2, column t: time repeats 0.2 s after 0.2 s; a recording is one motion")


def test_the_first_time_may_be_anything_finite():
    RowCheck("file", ("t", "q1", "tau1"))(block(-1e300, 0, 1e300), place)
