"""Readings that a joint cannot give are doubted once, and nothing else is."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.canopen.node import GlitchFilter

CYCLE_NS = 5_000_000
LIMIT = 2.0
REACH = 3.0 * LIMIT * (0.005 + 0.002)
"""Three times the speed limit, over a cycle and what a drive may sample later [rad]."""


def watching(limit: float = LIMIT) -> GlitchFilter:
    glitches = GlitchFilter()
    glitches.limit = limit
    return glitches


def believed(glitches: GlitchFilter, positions: list[float]) -> list[bool]:
    return [glitches.believes_place(position, cycle * CYCLE_NS) for cycle, position in enumerate(positions)]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_may_go_as_far_as_it_can_and_no_farther(sign: float) -> None:
    assert believed(watching(), [0.0, sign * 0.999 * REACH]) == [True, True]
    assert believed(watching(), [0.0, sign * 1.001 * REACH]) == [True, False]


def test_one_false_reading_is_left_out_and_the_next_is_judged_by_the_one_before() -> None:
    assert believed(watching(), [0.1, 0.9, 0.1, 0.12]) == [True, False, True, True]


def test_a_joint_that_truly_is_elsewhere_is_believed_from_the_second_reading_on() -> None:
    assert believed(watching(), [0.1, 0.9, 0.9, 0.91]) == [True, False, True, True]


def test_a_joint_that_runs_away_is_seen() -> None:
    assert believed(watching(), [0.5 * cycle for cycle in range(7)]) == [True, False, True, False, True, False, True]


def test_a_joint_that_was_not_heard_for_long_may_be_far_away() -> None:
    nothing = math.nan
    assert believed(watching(), [0.0, *[nothing] * 9, 0.3]) == [True] * 11


def test_a_speed_beyond_all_limits_is_doubted_once() -> None:
    glitches = watching()
    assert [glitches.believes_speed(v) for v in (5.9, 6.1, 5.9, -6.1, -6.1, math.nan)] == [
        True,
        False,
        True,
        False,
        True,
        True,
    ]


def test_nothing_is_doubted_before_a_limit_is_known() -> None:
    assert believed(GlitchFilter(), [0.0, 1e9, -1e9]) == [True, True, True]
    assert GlitchFilter().believes_speed(1e9)


@given(st.integers(0, 31), st.integers(1, 18), st.floats(-LIMIT, LIMIT))
def test_every_altered_bit_that_carries_far_is_noticed(bit: int, cycle: int, speed: float) -> None:
    """A joint at constant speed, whose position has one bit altered in one cycle, of 2**21 counts a radian."""
    counts = [round(speed * 0.005 * k * 2**21) for k in range(20)]
    leap = 2.0 ** (bit - 21)
    counts[cycle] ^= 1 << bit
    told = believed(watching(), [count / 2**21 for count in counts])
    if leap > REACH + 0.005 * LIMIT:
        assert told == [k != cycle for k in range(20)]
    if leap < REACH - 0.005 * LIMIT:
        assert all(told)
