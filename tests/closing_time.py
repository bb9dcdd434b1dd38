"""An end for a machine whose time is bounded: tests that have not begun by then are skipped, and say so.

`TAUSCOPE_TESTS_END` is the instant in seconds since 1970; without it every test runs.
"""

import os
import time

import pytest

END = "TAUSCOPE_TESTS_END"
SAID = f"not run: the time that {END} allows was over"


def is_over() -> bool:
    """Whether the time is over; asked by tests that go on for long, too."""
    return time.time() > float(os.environ.get(END, "inf"))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what would begin too late."""
    if is_over():
        pytest.skip(SAID)
