"""The unit of 0x6076: the standard's mNm, or a maker's µNm, by what the joint may exert."""

import pytest

from tauscope_drivers.canopen.units import read_rated_torque

EPOS4 = 512_871
"""Of a real drive of 0.513 Nm, which states µNm."""


@pytest.mark.parametrize(
    ("value", "limit", "current_ma", "nm"),
    [
        (500, 20.0, None, 0.5),
        (EPOS4, 20.0, None, 0.512871),
        (EPOS4, None, 5_000, 0.512871),
        (EPOS4, None, None, 0.512871),
        (EPOS4, float("inf"), None, 0.512871),
        (310, None, 4_000, 0.31),
        (60_000, None, None, 60.0),
        (EPOS4, 1000.0, None, 0.512871),
    ],
)
def test_the_unit_is_the_one_that_fits(value: int, limit: float | None, current_ma: int | None, nm: float) -> None:
    found = read_rated_torque(value, 50.0, limit, current_ma)
    assert found.nm == pytest.approx(nm)
    assert ("is taken in µNm" in found.remark) == (value == EPOS4)


def test_a_limit_that_stands_for_none_is_told_and_does_not_change_the_unit() -> None:
    """Descriptions of robots have limits of 1000 Nm in place of none."""
    found = read_rated_torque(100, 50.0, 1000.0, None)
    assert found.nm == pytest.approx(0.1)
    assert found.remark.startswith("is taken in mNm, 0.1 Nm, which is far below the joint's torque limit of 1000")


@pytest.mark.parametrize(("value", "limit"), [(0, 20.0), (EPOS4, 0.5)])
def test_a_value_that_fits_neither_is_refused(value: int, limit: float) -> None:
    with pytest.raises(ValueError, match=r"reads 0|neither fits the joint's torque limit"):
        read_rated_torque(value, 50.0, limit, None)
