"""A test that plays the host of a device in real time runs as the control process does: nobody makes it wait."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

PRIORITY = 60


@contextmanager
def prompt_process() -> Iterator[None]:
    """SCHED_FIFO for this thread where the system permits it; else the machine has to be quiet enough."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
    except OSError:
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)
