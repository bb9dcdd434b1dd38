"""Numbers and units as people read them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope import number_text
from tauscope.number_text import ABSENT, counted, percent, significant, with_uncertainty
from tauscope.report.words import base_parameter_unit
from tauscope.robot import JointType

numbers = st.floats(-1e12, 1e12)


@pytest.mark.parametrize(
    ("value", "std", "shown"),
    [
        (0.0589256, 0.0063, ("0.0589", "0.0063")),
        (203.4812, 1.23, ("203.5", "1.2")),
        (95.11, 12.3, ("95", "12")),
        (123456.0, 789.0, ("123460", "790")),
        (-0.00001, 0.02, ("0.000", "0.020")),
        (1.5, 0.0, ("1.5", ABSENT)),
        (1.5, None, ("1.5", ABSENT)),
        (1.5, math.inf, ("1.5", ABSENT)),
        (14334.2, None, ("14330", ABSENT)),
        (2.0e-13, 1.0e-14, ("2.00e-13", "1.0e-14")),
    ],
)
def test_a_value_is_as_long_as_its_error(value: float, std: float | None, shown: tuple[str, str]) -> None:
    assert with_uncertainty(value, std) == shown


@given(numbers, st.floats(1e-12, 1e12))
def test_rounding_is_small_beside_the_error(value: float, std: float) -> None:
    number, error = with_uncertainty(value, std)
    assert float(number) == pytest.approx(value, abs=0.0501 * std, rel=1e-14)
    assert float(error) == pytest.approx(std, rel=0.051)


@given(numbers.filter(bool), st.integers(1, 8))
def test_significant_digits_are_kept(value: float, digits: int) -> None:
    assert float(significant(value, digits)) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_what_is_no_number_is_absent(value: float | None) -> None:
    assert significant(value) == percent(value) == number_text.given(value) == ABSENT


@pytest.mark.parametrize(
    ("share", "shown"), [(0.0374, "3.7 %"), (1.5, "150.0 %"), (0.0091, "0.91 %"), (0.0, "0 %"), (1e-6, "1.0e-04 %")]
)
def test_percentages(share: float, shown: str) -> None:
    assert percent(share) == shown


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (0.99999999, "1.000"),
        (9.9996, "10.00"),
        (123456.0, "123500"),
        (1e-5, "1.000e-05"),
        (-0.5, "-0.5000"),
    ],
)
def test_significant_digits(value: float, shown: str) -> None:
    assert significant(value) == shown


def test_counts() -> None:
    assert [counted(number, "joint") for number in (0, 1, 2)] == ["0 joints", "1 joint", "2 joints"]


def test_units() -> None:
    assert (JointType.PRISMATIC.torque_unit, JointType.PRISMATIC.unit) == ("N", "m")
    assert (JointType.REVOLUTE.torque_unit, JointType.REVOLUTE.unit) == ("Nm", "rad")
    assert base_parameter_unit({"m2": 1.0, "msx2": 2.0}) == "kg"
    assert base_parameter_unit({"msx2": 1.0, "m3": 0.5}) == "kg m"
    assert base_parameter_unit({"Ixx2": 1.0, "msx2": 0.5}) == "kg m²"
