"""How many rows count as one, against autoregressions whose κ is known in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt, sosfreqz

from tauscope.diagnosis.evidence.dependence import ORDER, RIDGE, Succession

Array = NDArray[np.float64]
ROWS = 40_000


def coloured(correlation: float, seed: int, rows: int = ROWS) -> Array:
    """x_k = ρ x_{k-1} + e_k."""
    return np.asarray(lfilter([1.0], [1.0, -correlation], np.random.default_rng(seed).standard_normal(rows)))


def instants_of(rows: int) -> Array:
    return np.arange(0, rows, dtype=np.float64) / 10.0


def unbroken(rows: int) -> Succession:
    return Succession.of(np.zeros(rows, dtype=np.intp), instants_of(rows))


@pytest.mark.parametrize("correlation", [0.2, 0.5, 0.7])
def test_an_autoregression_counts_by_its_closed_form(correlation: float) -> None:
    expected = (1.0 + correlation) / (1.0 - correlation)
    # what is added at lag 0 takes a few per cent
    assert unbroken(ROWS).dependence(coloured(correlation, 1)) == pytest.approx(expected, rel=0.1)


@settings(max_examples=15)
@given(st.integers(0, 10_000))
def test_rows_of_white_noise_count_as_one_each(seed: int) -> None:
    assert 1.0 <= unbroken(ROWS).dependence(coloured(0.0, seed)) < 1.1


@given(st.integers(0, 10_000), st.floats(-0.95, 0.95), st.floats(1e-6, 1e6))
def test_the_unit_of_the_rows_does_not_matter(seed: int, correlation: float, unit: float) -> None:
    rows = coloured(correlation, seed, 500)
    asked = unbroken(500)
    found = asked.dependence(rows)
    assert found >= 1.0
    assert asked.dependence(unit * rows) == pytest.approx(found, rel=1e-6)


def test_rows_that_alternate_count_as_no_more_than_they_are() -> None:
    assert unbroken(ROWS).dependence(coloured(-0.6, 2)) == 1.0


def test_a_constant_torque_has_a_limit() -> None:
    """Σ a = p / (p + r), and 1 - Σ a γ = (p + 1) r / p, to first order in r: κ = p (p + 1) / r."""
    assert unbroken(200_000).dependence(np.ones(200_000)) == pytest.approx(ORDER * (ORDER + 1) / RIDGE, rel=0.1)


@pytest.mark.parametrize("band", [0.4, 0.6, 0.75])
def test_white_noise_behind_a_low_pass_counts_by_its_bandwidth(band: float) -> None:
    """κ = π / ∫ |H|² dω: what is slower than the filter is as uncertain as if there were none."""
    low_pass = butter(6, band, output="sos")
    rows = sosfiltfilt(low_pass, np.random.default_rng(4).standard_normal(ROWS))
    gain = np.abs(sosfreqz(low_pass, 4096)[1]) ** 4
    assert unbroken(ROWS).dependence(np.asarray(rows)) == pytest.approx(1.0 / gain.mean(), rel=0.2)


def test_rows_that_are_nothing_count_as_one_each() -> None:
    assert unbroken(10).dependence(np.zeros(10)) == 1.0


@pytest.mark.parametrize("broken_by", ["recording", "gap", "going back"])
def test_a_gap_breaks_a_stretch(broken_by: str) -> None:
    recording, instants = np.zeros(100, dtype=np.intp), instants_of(100)
    if broken_by == "recording":
        recording[40:] = 1
    elif broken_by == "gap":
        instants[40:] += 0.1
    else:
        instants[40:] -= instants[40]
    assert Succession.of(recording, instants).bounds == ((0, 40), (40, 100))


def test_rows_beyond_a_gap_are_no_neighbours() -> None:
    """Where each row is a stretch of its own, none resembles its predecessor."""
    alone = Succession.of(np.arange(ROWS), instants_of(ROWS))
    assert alone.dependence(coloured(0.7, 3)) == 1.0
