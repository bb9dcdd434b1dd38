"""How often a process is killed in each series, and which of the kills count."""

import os
from collections.abc import Callable
from typing import TypeVar

import pytest

from standstill import STANDSTILL_S, Onlooker

T = TypeVar("T")

KILLS = int(os.environ.get("TAUSCOPE_KILLS", "100"))
"""In a whole series, which begins with the same ones as a short one."""

SERIES = pytest.mark.parametrize("times", [3, pytest.param(KILLS, marks=pytest.mark.proof)])


def killed_often(kill: Callable[[], T | None], times: int) -> list[T]:
    """What each of so many kills says.

    One that comes too late (None) says nothing, nor does one that fails while the machine stands still, whose devices
    stand still with it: both are repeated, where they are not many.
    """
    said: list[T] = []
    for _ in range(2 * times + 3):
        with Onlooker() as onlooker:
            try:
                one = kill()
            except (AssertionError, pytest.fail.Exception):
                if onlooker.longest_s < STANDSTILL_S:
                    raise
                one = None
        if one is not None:
            said.append(one)
        if len(said) == times:
            return said
    pytest.fail(f"only {len(said)} of {times} kills count: the machine is too busy")
