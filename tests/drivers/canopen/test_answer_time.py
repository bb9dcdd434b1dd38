"""An answer is late by what it took longer than is usual, whatever that is."""

from tauscope_drivers.clock import REMEMBERED, AnswerTime


def test_the_first_answer_is_not_late_and_a_slow_adapter_is_not_either() -> None:
    times = AnswerTime()
    assert [times.late_ns(9_000_000) for _ in range(3)] == [0, 0, 0]


def test_one_that_waited_is_late_by_the_wait_and_changes_nothing_for_the_next() -> None:
    times = AnswerTime()
    late = [times.late_ns(1_000_000 + wait) for wait in (0, 0, 0, 0, 2_500_000, 0, 1, 2_500_000)]
    assert late == [0, 0, 0, 0, 2_500_000, 0, 1, 2_500_000]


def test_one_that_is_early_is_not_late() -> None:
    times = AnswerTime()
    assert [times.late_ns(taken) for taken in (500, 500, 500, 100)] == [0, 0, 0, 0]


def test_what_is_usual_is_learnt_anew() -> None:
    times = AnswerTime()
    late = [times.late_ns(1_000) for _ in range(REMEMBERED)] + [times.late_ns(3_000) for _ in range(REMEMBERED)]
    half = REMEMBERED + REMEMBERED // 2
    assert late[REMEMBERED:half] == [2_000] * (REMEMBERED // 2)
    assert late[half + 1 :] == [0] * (REMEMBERED // 2)
