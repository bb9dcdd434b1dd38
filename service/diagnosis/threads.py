"""Array work side by side: it runs beside other threads, since NumPy gives the interpreter away meanwhile."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

THREADS = 2
"""More gain nothing: between the arrays there is Python."""

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def side_by_side(work: Callable[[_Item], _Result], items: Iterable[_Item]) -> list[_Result]:
    """Results in the order of the items, two of which are worked on at once.

    Parameters
    ----------
    work : callable
        what is done with one; must not wait for another
    items : iterable
        to work on
    """
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(work, items))
