"""Where jobs are kept, and an executor that works when a test says so."""

from pathlib import Path

import pytest

from server.queue.executors import ManualExecutor
from tauscope.server.store.items import ItemStore


@pytest.fixture
def items(tmp_path: Path) -> ItemStore:
    return ItemStore(tmp_path / "jobs", "job")


@pytest.fixture
def executor() -> ManualExecutor:
    return ManualExecutor()
