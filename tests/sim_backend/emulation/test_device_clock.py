"""Emulated devices keep up with a clock step by step, and lose what a machine that stood still made them miss."""

import pytest

from tauscope_sim.emulation.emulator import ALL_STEPS, LONGEST_CATCH_UP_S, MOST_STEPS, STEP_S, DeviceClock

ROUNDING_S = 1e-9


def test_a_step_is_taken_when_it_is_over_and_ends_where_the_clock_stands() -> None:
    clock, ends = DeviceClock(0.0), []
    for now_ms in (0.0, 0.9, 1.9, 4.0):
        clock.catch_up(now_ms * 1e-3 + ROUNDING_S, lambda: ends.append(clock.now_s))
    assert ends == pytest.approx([0.001, 0.002, 0.003, 0.004])
    assert clock.lost_s == 0.0


def test_no_more_steps_at_once_than_asked_and_the_rest_is_made_up_for() -> None:
    clock, ends, counts = DeviceClock(2.0), [], []
    for most_steps in (MOST_STEPS, 3, ALL_STEPS):
        clock.catch_up(2.1 + ROUNDING_S, lambda: ends.append(clock.now_s), most_steps)
        counts.append(len(ends))
    assert counts == [MOST_STEPS, MOST_STEPS + 3, 100]
    assert ends == pytest.approx([2.0 + 0.001 * number for number in range(1, 101)])
    assert clock.lost_s == 0.0


def test_a_machine_that_stood_still_loses_all_but_the_longest_catch_up() -> None:
    clock, ends = DeviceClock(0.0), []
    clock.catch_up(3.0, lambda: ends.append(clock.tick), most_steps=1)
    assert clock.lost_s == pytest.approx(3.0 - LONGEST_CATCH_UP_S)
    assert ends == [1], "the steps that are lost are not counted"
    assert clock.now_s == pytest.approx(3.0 - LONGEST_CATCH_UP_S + STEP_S)
    clock.catch_up(3.0 + ROUNDING_S, lambda: ends.append(clock.tick), most_steps=ALL_STEPS)
    assert ends == list(range(1, 251))
    assert clock.lost_s == pytest.approx(3.0 - LONGEST_CATCH_UP_S), "what can be made up for is not lost"
    clock.catch_up(4.0, lambda: None, most_steps=0)
    assert clock.lost_s == pytest.approx(3.0 - LONGEST_CATCH_UP_S + 1.0 - LONGEST_CATCH_UP_S), "losses add up"
