import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recording.recording_files import message_of
from tauscope.recording import EffortKind, Reading
from tauscope.recording.intake import Choice, RowIntake


def place(row: int) -> str:
    return f"line {row + 2}"


def block(*times: float) -> np.ndarray:
    return np.column_stack([np.array(times), np.zeros((len(times), 2))])


def intake() -> RowIntake:
    return RowIntake(Choice("file"), ("t", "q1", "tau1"), EffortKind.TORQUE)


def test_time_rises_from_block_to_block():
    rows = intake()
    rows.add(block(*range(20)), place)
    rows.add(block(), place)
    rows.add(block(20.0), place)
    message = message_of(lambda: rows.add(block(5.0, 21.0), place))
    assert message.startswith(
        "file: line 2, column t: time runs backwards: 5.0 s after 20.0 s; a recording is one motion"
    )


def test_late_and_repeated_rows_are_mended_across_blocks():
    rows = intake()
    rows.add(block(*range(20)), place)
    rows.add(block(18.5, 19.0, 21.0, 20.0), place)
    recording = rows.finish(1)
    assert recording.samples().time.tolist() == [*range(18), 18, 18.5, 19, 20, 21]
    assert len(recording.warnings) == 2


def test_the_first_time_may_be_anything_finite():
    intake().add(block(-1e300, 0, 1e300), place)


@pytest.mark.parametrize("bits", [16, 32])
@given(begins=st.integers(1, 300), sizes=st.lists(st.integers(0, 40), max_size=8))
def test_a_counter_that_begins_again_goes_on(bits: int, begins: int, sizes: list[int]) -> None:
    counts = (np.arange(300) * 10 - 10 * begins) % 2**bits
    rows = RowIntake(Choice("file", reading=Reading(units={"t": "ms"})), ("t", "q1", "tau1"), EffortKind.TORQUE)
    for part in np.split(counts, np.minimum(np.cumsum(sizes), len(counts)) if sizes else 1):
        rows.add(block(*part), place)
    recording = rows.finish(1)
    assert np.allclose(np.diff(recording.samples().time), 0.01)
    assert len(recording.warnings) == (begins < 300)


def test_a_clock_that_is_set_back_is_no_counter() -> None:
    rows = RowIntake(Choice("file", reading=Reading(units={"t": "ms"})), ("t", "q1", "tau1"), EffortKind.TORQUE)
    message = message_of(lambda: rows.add(block(*range(60_000, 60_500, 10), *range(0, 500, 10)), place))
    assert "time runs backwards" in message
