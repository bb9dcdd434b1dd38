"""Numbers as people read them."""

import math

ABSENT = "–"
"""Stands where there is no number."""

_MOST_DECIMALS = 9
_PLAIN_RANGE = (1e-4, 1e7)


def significant(value: float | None, digits: int = 4) -> str:
    """A number to some significant digits, without an exponent where it is of usual size."""
    if value is None or not math.isfinite(value):
        return ABSENT
    if value == 0.0:
        return "0"
    if not _PLAIN_RANGE[0] <= abs(value) < _PLAIN_RANGE[1]:
        return f"{value:.{digits - 1}e}"
    rounded = float(f"{value:.{digits - 1}e}")  # first: 0.99999 is 1.000 and not 1.0000
    return f"{rounded:.{max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)}f}"


def given(value: float | None) -> str:
    """A number that somebody stated, as it was stated: no digits are added."""
    return ABSENT if value is None or not math.isfinite(value) else f"{value:.6g}"


def with_uncertainty(value: float, std: float | None) -> tuple[str, str]:
    """A value and its standard error: the error to two significant digits, the value to the same decimal place."""
    if std is None or not math.isfinite(std) or std <= 0.0:
        return f"{float(f'{value:.3e}'):g}", ABSENT
    decimals = 1 - math.floor(math.log10(std))
    largest = max(abs(value), std)
    if decimals > _MOST_DECIMALS or largest >= _PLAIN_RANGE[1]:
        digits = min(max(math.floor(math.log10(largest)) + decimals, 1), 15)
        return f"{value:.{digits}e}", f"{std:.1e}"
    shown = max(decimals, 0)
    rounded = round(value, decimals) + 0.0  # no minus zero
    return f"{rounded:.{shown}f}", f"{round(std, decimals):.{shown}f}"


def percent(share: float | None) -> str:
    """A share as per cent, to two significant digits or a tenth."""
    if share is None or not math.isfinite(share):
        return ABSENT
    hundredths = 100.0 * share
    if 0.0 < hundredths < 0.01:
        return f"{hundredths:.1e} %"
    return f"{hundredths:.1f} %" if hundredths >= 1.0 else f"{hundredths:.2g} %"


def counted(count: int, thing: str) -> str:
    """A number of things: ``1 joint``, ``3 joints``."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def chance(probability: float) -> str:
    """A probability as per cent; what is not certain is never said to be.

    Parameters
    ----------
    probability : float
        from 0 to 1
    """
    return "> 99 %" if 0.99 < probability < 1.0 else f"{100.0 * probability:.0f} %"


def power_of_ten(value: float) -> str:
    """A number on a logarithmic axis."""
    if 1e-3 < abs(value) < 1e4 or value == 0.0:
        return f"{value:g}".replace("-", "\N{MINUS SIGN}")
    exponent = round(math.log10(abs(value)))
    digits = str(exponent).translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))
    sign = "\N{MINUS SIGN}" if value < 0.0 else ""
    return f"{sign}10{digits}"
