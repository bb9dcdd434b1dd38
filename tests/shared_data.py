"""Where the recordings of real arms, and files as people bring them, lie: never in this repository."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
SHARED_DATA = Path(os.environ.get("TAUSCOPE_DATA") or REPOSITORY.parent / "shared" / "data")
ABSENT = f"no recordings at {SHARED_DATA}; name their folder in TAUSCOPE_DATA"

needs_shared_data = pytest.mark.skipif(not SHARED_DATA.is_dir(), reason=ABSENT)
"""Marks a test, or a module by ``pytestmark``, that reads the recordings."""

SHARED_CASES = Path(os.environ.get("TAUSCOPE_CASES") or REPOSITORY.parent / "shared" / "cases")

needs_shared_cases = pytest.mark.skipif(
    not SHARED_CASES.is_dir(), reason=f"no files at {SHARED_CASES}; name their folder in TAUSCOPE_CASES"
)
"""The same for the files as people bring them."""
