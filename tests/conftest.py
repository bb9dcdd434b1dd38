"""What every test may use: the real recordings and the settings of Hypothesis."""

import gc
import os
import signal
import tempfile
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

from shared_data import ABSENT, SHARED_DATA

pytest_plugins = ["standstill", "selection"]

# What servos had in EEPROM before a run is kept there, and not where this account keeps it.
os.environ["TAUSCOPE_STATE"] = tempfile.mkdtemp(prefix="tauscope-state-")

# Deadlines measure the machine, not the code; on CI the same examples are drawn on every run. A test whose property
# is harder than a few examples says so itself, and is slow.
settings.register_profile("ci", max_examples=25, derandomize=True, deadline=None, print_blob=True)
settings.register_profile("dev", max_examples=25, deadline=None)
settings.load_profile("ci" if os.environ.get("CI") else "dev")

# A shell starts what it runs in the background with SIGINT ignored, and programs under test would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Six thousand tests live as long as the process: the garbage collector need not look at them again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        gc.set_threshold(20_000, 20, 50)


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Forget what a file's tests shared when the last of them has ended: the diagnoses of all would take gigabytes."""
    if isinstance(item, pytest.Function) and (nextitem is None or nextitem.path != item.path):
        for value in vars(item.module).values():
            if callable(clear := getattr(value, "cache_clear", None)):
                clear()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recordings of real arms; the test is skipped where there is none."""
    if os.environ.get("TAUSCOPE_DATA") and not SHARED_DATA.is_dir():
        pytest.fail(f"TAUSCOPE_DATA names {SHARED_DATA}, which is not a folder")
    if not SHARED_DATA.is_dir():
        pytest.skip(ABSENT)
    return SHARED_DATA
