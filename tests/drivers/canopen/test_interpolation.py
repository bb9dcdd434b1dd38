"""The cycle as 0x60C2 holds it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.canopen.commissioning import interpolation_period


@pytest.mark.parametrize(
    ("cycle_s", "held"),
    [
        (0.001, (1, -3)),
        (0.004, (4, -3)),
        (0.01, (10, -3)),
        (0.0025, (25, -4)),
        (1 / 300, (33, -4)),
        (0.00025, (25, -5)),
    ],
)
def test_milliseconds_where_they_are_exact(cycle_s: float, held: tuple[int, int]) -> None:
    assert interpolation_period(cycle_s) == held


@given(st.floats(1e-5, 0.25))
def test_it_is_near_for_every_cycle(cycle_s: float) -> None:
    value, exponent = interpolation_period(cycle_s)
    assert 1 <= value <= 255
    # two digits at least, or an exact number
    assert value * 10.0**exponent == pytest.approx(cycle_s, rel=0.5 / 10.0)
    assert exponent >= -6


@pytest.mark.parametrize("cycle_s", [1.0, 0.256, 1e-7])
def test_what_cannot_be_held_is_refused(cycle_s: float) -> None:
    with pytest.raises(ValueError, match="not between"):
        interpolation_period(cycle_s)
