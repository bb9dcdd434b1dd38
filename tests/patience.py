"""Waiting for what another thread or process does, no longer than it takes."""

import time
from collections.abc import Callable


def eventually(is_so: Callable[[], bool], within_s: float = 5.0) -> bool:
    """Whether something comes true in time."""
    deadline = time.monotonic() + within_s
    while not is_so():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.002)
    return True
