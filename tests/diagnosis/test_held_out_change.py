"""The change on held-out motion against statistics of made-up errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.diagnosis.model.held_out_change import LOST, SHOWN, SPILLED, STRETCHES, HeldOutChange, sum_stretches

SAMPLES = 4800


def squares(rng: np.random.Generator, *sizes: float) -> np.ndarray:
    return (np.array(sizes)[:, None] * rng.standard_normal((len(sizes), SAMPLES))) ** 2


def test_the_change_is_that_of_the_rms() -> None:
    before, after = (squares(np.random.default_rng(1), *sizes) for sizes in ((1.0, 2.0), (0.5, 2.0)))
    change = HeldOutChange.between(sum_stretches(before), sum_stretches(after))
    expected = np.sqrt(after.sum(axis=1) / before.sum(axis=1)) - 1.0
    assert change.relative == pytest.approx(expected, rel=1e-12)


def test_the_standard_error_is_the_spread_over_many_recordings() -> None:
    rng = np.random.default_rng(2)
    found = [
        HeldOutChange.between(sum_stretches(squares(rng, 1.0)), sum_stretches(squares(rng, 0.7))) for _ in range(300)
    ]
    spread = np.std([each.relative[0] for each in found])
    assert np.mean([each.error[0] for each in found]) == pytest.approx(spread, rel=0.1)


def test_errors_of_neighbours_that_are_alike_count_as_few() -> None:
    rng = np.random.default_rng(3)
    pairs = [(squares(rng, 1.0), squares(rng, 1.0)) for _ in range(50)]
    # a value held for 25 samples
    held = [tuple(np.repeat(each[:, ::25], 25, axis=1) for each in pair) for pair in pairs]
    free, tied = (
        np.mean([HeldOutChange.between(*map(sum_stretches, pair)).error[0] for pair in kind]) for kind in (pairs, held)
    )
    assert tied == pytest.approx(5.0 * free, rel=0.2)


def test_a_change_that_one_stretch_makes_is_one_standard_error_of_itself() -> None:
    before = np.append(1.0, np.full(STRETCHES - 1, 1e-9))[None]
    after = before * np.append(0.25, np.ones(STRETCHES - 1))
    change = HeldOutChange.between(before, after)
    assert change.relative[0] == pytest.approx(-0.5)
    assert np.abs(change.standard[0]) < 1.0


def test_nothing_is_told_of_motion_that_is_too_short_or_of_no_error_at_all() -> None:
    short = np.ones((1, 10))
    assert sum_stretches(short).shape == (1, 1)
    change = HeldOutChange.between(sum_stretches(short), sum_stretches(4.0 * short))
    assert (change.relative[0], change.error[0], change.standard[0]) == (1.0, np.inf, 0.0)
    still = HeldOutChange.between(np.zeros((1, STRETCHES)), np.zeros((1, STRETCHES)))
    assert (still.relative[0], still.standard[0]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("relative", "expected"),
    [
        (0.015, []),  # within two standard errors
        (0.03, [1]),
        (-0.03, []),
    ],
)
def test_a_joint_loses_where_it_is_clearly_predicted_worse(relative: float, expected: list[int]) -> None:
    assert HeldOutChange(np.array([-0.2, relative]), np.full(2, 0.01)).losing == expected


def test_a_loss_that_changes_no_number_that_is_shown_is_none() -> None:
    assert HeldOutChange(np.array([0.9 * SHOWN]), np.array([1e-4])).losing == []


RELATIVE = st.floats(-0.5, 0.5)


def change(relative: list[float], error: float = 0.01) -> HeldOutChange:
    return HeldOutChange(np.array(relative), np.full(len(relative), error))


@given(st.lists(RELATIVE, min_size=1, max_size=7), st.floats(1e-3, 0.1))
def test_log_odds_are_twice_the_square_of_every_joint_with_its_sign(relative: list[float], error: float) -> None:
    own = -2.0 * np.sign(relative) * (np.array(relative) / error) ** 2
    found = change(relative, error)
    assert found.log_odds() == pytest.approx(float(own.sum()))
    assert found.log_odds([0]) == pytest.approx(float(own[0]))


def test_a_change_without_an_error_says_nothing() -> None:
    assert change([-0.2, 0.0], 0.0).log_odds() == 0.0


@pytest.mark.parametrize(
    ("relative", "harm"),
    [
        ([-0.2, 0.0], 0.0),
        ([-0.2, 0.9 * LOST * 0.01], 0.0),  # worse by chance
        ([0.0, 0.1], np.log(1.1)),
        ([-0.3, 0.1], np.log(1.1) + SPILLED * np.log(0.7)),  # others gain far more
        ([-0.1, 0.1], np.log(1.1) + SPILLED * np.log(0.9)),
    ],
)
def test_harm_is_what_joints_lose_beyond_a_part_of_what_others_gain(relative: list[float], harm: float) -> None:
    assert change(relative).harm == pytest.approx(harm)


def test_a_small_loss_beside_a_large_gain_is_no_harm() -> None:
    assert change([-0.3, 0.05]).harm <= 0.0 < change([-0.1, 0.1]).harm


@given(st.lists(RELATIVE, min_size=1, max_size=7))
def test_only_a_joint_that_is_clearly_worse_is_harmed(relative: list[float]) -> None:
    found = change(relative)
    assert found.harm <= 0.0 or bool((found.standard > LOST).any())


@given(st.lists(RELATIVE, min_size=1, max_size=7), st.floats(1e-3, 0.1), st.floats(0.0, 5.0))
def test_a_change_says_no_more_than_a_torque_of_its_size_would(
    relative: list[float], error: float, expected: float
) -> None:
    standard = np.array(relative) / error
    found = HeldOutChange(np.array(relative), np.full(len(relative), error), np.full(len(relative), expected))
    assert found.log_odds() == pytest.approx(float(np.sum(-2.0 * standard * np.minimum(np.abs(standard), expected))))


def test_what_two_models_differ_in_is_expected_in_standard_errors() -> None:
    rng = np.random.default_rng(4)
    noise, torque = rng.standard_normal(SAMPLES), 0.2 * np.sin(np.arange(SAMPLES) / 7.0)
    sums = [sum_stretches(np.square(each)[None]) for each in (noise + torque, noise, torque)]
    change = HeldOutChange.between(*sums)
    assert change.expected == pytest.approx(np.sqrt(np.sum(torque**2)) / 2.0, rel=0.25)
    short = np.ones((1, 10))
    assert HeldOutChange.between(*[sum_stretches(short)] * 3).log_odds() == 0.0
