"""Late answers are kept apart from those to the question that was just asked."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.dynamixel.bus import Turns
from tauscope_drivers.dynamixel.packets import Status


def fresh(servo: int) -> Status:
    return Status(servo, 0, b"now" + bytes([servo]))


def stale(servo: int) -> Status:
    return Status(servo, 0, b"old" + bytes([servo]))


def take(*statuses: Status, owed: tuple[int, ...] = ()) -> Turns:
    turns = Turns([1, 2, 3, 4], owed)
    for status in statuses:
        turns.take(status)
    return turns


def test_answers_in_turn_are_all_kept() -> None:
    turns = take(*(fresh(servo) for servo in (1, 2, 3, 4)))
    assert turns.complete
    assert list(turns.answers) == [1, 2, 3, 4]


def test_silent_servo_does_not_cost_the_others() -> None:
    turns = take(fresh(1), fresh(3), fresh(4))
    assert not turns.complete
    assert list(turns.answers) == [1, 3, 4]


def test_equal_answers_count_once() -> None:
    assert take(*(fresh(servo) for servo in (1, 1, 2, 3, 3, 4, 4))).complete


def test_answers_that_contradict_each_other_count_as_none() -> None:
    assert list(take(stale(1), fresh(1), fresh(2), fresh(3), fresh(4)).answers) == [2, 3, 4]


def test_stranger_is_passed_over() -> None:
    assert list(take(Status(9, 0, b"now"), fresh(1)).answers) == [1]


@given(servo=st.sampled_from([1, 2, 3, 4]), place=st.integers(0, 4))
def test_no_late_answer_is_kept_while_everybody_answers(servo: int, place: int) -> None:
    answers = [fresh(number) for number in (1, 2, 3, 4)]
    answers.insert(place, stale(servo))
    # A late answer right before the servo's own turn is the one case that only the drained line rules out.
    turns = take(*answers)
    assert all(status.data.startswith(b"now") for status in turns.answers.values())


@pytest.mark.parametrize("servo", [1, 2, 3, 4])
def test_owed_answer_that_comes_alone_is_not_believed(servo: int) -> None:
    assert take(stale(servo), owed=(servo,)).answers == {}


def test_owed_answer_beside_another_is_believed() -> None:
    assert list(take(fresh(1), fresh(2), owed=(1,)).answers) == [1, 2]
    assert list(take(fresh(2), fresh(3), owed=(3,)).answers) == [2, 3]


@pytest.mark.parametrize("owed", [(1, 3), (1, 2, 3, 4)])
def test_owed_answers_without_another_are_not_believed(owed: tuple[int, ...]) -> None:
    turns = take(stale(1), stale(3), owed=owed)
    assert turns.answers == {}
    assert turns.unheard == {2, 4}


def test_a_whole_round_of_late_answers_before_the_new_one_is_not_believed() -> None:
    everybody = (1, 2, 3, 4)
    turns = take(*map(stale, everybody), *map(fresh, everybody), owed=everybody)
    assert turns.answers == {}


def test_any_order_of_answers_is_survived() -> None:
    for order in itertools.permutations((1, 2, 3, 4)):
        assert set(take(*(fresh(servo) for servo in order)).answers) <= {1, 2, 3, 4}
