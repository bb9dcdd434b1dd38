"""A window in time: what is there in every stretch of it is found, what only the noise does is not."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tauscope.diagnosis.search.window import FEWEST, SHORTEST, STRETCHES, window_log_odds

Array = NDArray[np.float64]
Inside = NDArray[np.bool_]
ROWS = 600


class Labels:
    """Observations of one recording without pieces."""

    def __init__(self, rows: int) -> None:
        self.rows = rows

    def __iter__(self) -> Iterator[Any]:
        return iter(())

    def row_labels(self, joint: int) -> tuple[NDArray[np.intp], Array]:
        return np.zeros(self.rows, dtype=np.intp), np.arange(self.rows) / 25.0


def log_odds(residual: NDArray[Any], inside: Inside, explained: NDArray[Any], sigma: float = 1.0) -> float:
    """Of one joint, where an effect that is one inside its window takes this from a residual."""
    shuffled = np.random.default_rng(0).permutation(len(residual))
    left = {"before": [residual], "after": [residual - explained]}
    rows = SimpleNamespace(
        observations=Labels(len(residual)),
        order=(shuffled,),
        columns=lambda *_: {0: np.where(inside, 1.0, 0.0)[None, None]},
        take=lambda joint, own, dependence: own[..., shuffled],
        white=SimpleNamespace(residual=lambda model: left[model]),
    )
    laboratory: Any = SimpleNamespace(rows=rows)
    scales = (SimpleNamespace(values=np.array([np.log(sigma)])),)
    before: Any = SimpleNamespace(model="before", scales=scales)
    after: Any = SimpleNamespace(model="after", scales=scales)
    term: Any = SimpleNamespace(effect=SimpleNamespace(touched=lambda count: (0,)), shape=np.zeros(1))
    return window_log_odds(before, after, term, laboratory)


def window(first: int, count: int) -> Inside:
    return (np.arange(ROWS) >= first) & (np.arange(ROWS) < first + count)


@given(st.integers(0, 10_000), st.floats(2.0, 10.0), st.integers(STRETCHES * SHORTEST, 300))
def test_a_shift_all_over_the_window_is_found(seed: int, shift: float, count: int) -> None:
    inside = window(100, count)
    noise = np.random.default_rng(seed).standard_normal(ROWS)
    assert log_odds(noise + shift * inside, inside, shift * inside) > 10.0


def test_noise_that_one_stretch_explains_is_not() -> None:
    """The mean of noise inside the window, taken out: most gain nothing."""
    inside, found = window(100, 200), []
    for seed in range(200):
        noise = np.random.default_rng(seed).standard_normal(ROWS)
        found.append(log_odds(noise, inside, noise[inside].mean() * inside))
    assert np.mean(np.array(found) > np.log(ROWS)) < 0.02


def test_a_burst_in_a_small_part_of_the_window_is_not() -> None:
    inside, burst = window(100, 240), window(200, 6)
    residual = np.random.default_rng(4).standard_normal(ROWS) + 40.0 * burst
    assert log_odds(residual, inside, residual[inside].mean() * inside) < np.log(ROWS)


@given(st.integers(0, 10_000), st.integers(1, SHORTEST * FEWEST - 1))
def test_fewer_rows_than_stretches_need_say_nothing(seed: int, count: int) -> None:
    inside = window(100, count)
    noise = np.random.default_rng(seed).standard_normal(ROWS)
    assert log_odds(noise + 50.0 * inside, inside, 50.0 * inside) == -np.inf
    enough = window(100, SHORTEST * FEWEST)
    assert log_odds(noise + 50.0 * enough, enough, 50.0 * enough) > 0.0


def test_an_effect_that_leaves_most_of_what_is_there_is_not_found() -> None:
    inside = window(100, 200)
    noise = np.random.default_rng(1).standard_normal(ROWS)
    assert log_odds(noise + 10.0 * inside, inside, 2.0 * inside) == -np.inf
    assert log_odds(noise + 10.0 * inside, inside, -2.0 * inside) == -np.inf


def test_a_window_without_an_outside_has_nothing_to_compare_with() -> None:
    everywhere = np.ones(ROWS, dtype=bool)
    noise = np.random.default_rng(2).standard_normal(ROWS)
    assert log_odds(noise + 5.0, everywhere, np.full(ROWS, 5.0)) == -np.inf


def test_the_noise_of_the_joint_cancels() -> None:
    inside = window(100, 200)
    noise = np.random.default_rng(3).standard_normal(ROWS)
    asked = noise + 3.0 * inside, inside, 3.0 * inside
    assert log_odds(*asked, sigma=7.0) == pytest.approx(log_odds(*asked))
