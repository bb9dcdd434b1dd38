"""What every test may use: the real recordings and the settings of Hypothesis."""

import gc
import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

from shared_data import ABSENT, SHARED_DATA

pytest_plugins = ["standstill", "selection"]

# Deadlines measure the machine, not the code; on CI the same examples are drawn on every run.
settings.register_profile("ci", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("dev", deadline=None)
settings.load_profile("ci" if os.environ.get("CI") else "dev")

# A shell starts what it runs in the background with SIGINT ignored, and programs under test would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Six thousand tests live as long as the process: the collector need not look at them again and again."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recordings of real arms; the test is skipped where there is none."""
    if os.environ.get("TAUSCOPE_DATA") and not SHARED_DATA.is_dir():
        pytest.fail(f"TAUSCOPE_DATA names {SHARED_DATA}, which is not a folder")
    if not SHARED_DATA.is_dir():
        pytest.skip(ABSENT)
    return SHARED_DATA
