"""The interpolation time period (0x60C2): over which time a drive moves from one target to the next.

A drive in cyclic synchronous position mode takes a target at every SYNC and goes there within this time. One that is
told too short a time makes a jerk and a halt of every target; one that is told too long a time lags behind.
"""

_EXPONENTS = range(-3, -7, -1)
"""Milliseconds first: some drives know nothing else."""

_LARGEST = 0xFF
_ROUNDING = 1e-6


def interpolation_period(cycle_s: float) -> tuple[int, int]:
    """Value and exponent of a cycle: value · 10^exponent seconds, exact where that is possible, else as near as can be.

    Parameters
    ----------
    cycle_s : float
        time between two targets [s]

    Raises
    ------
    ValueError
        the cycle is shorter or longer than the object can tell
    """
    best: tuple[float, int, int] | None = None
    for exponent in _EXPONENTS:
        value = round(cycle_s / 10.0**exponent)
        if not 1 <= value <= _LARGEST:
            continue
        error = abs(value * 10.0**exponent / cycle_s - 1.0)
        if best is None or error < best[0] - _ROUNDING:
            best = (error, value, exponent)
    if best is None:
        raise ValueError(f"a cycle of {cycle_s:g} s is not between 1 µs and {_LARGEST} ms")
    return best[1:]
