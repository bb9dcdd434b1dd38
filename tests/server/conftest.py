"""The service in this process: work is done at once, or when a test says so."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from databases import address, database, postgres
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.paper_files import PAPER_ROBOT, write_recording
from tauscope.server.http import Settings, create_app
from tauscope.server.store.items import ItemStore

__all__ = ["address", "database", "postgres"]

HOST = "http://127.0.0.1:8000"
IDENTIFICATIONS = "/api/v1/identifications"
RECORDINGS = "/api/v1/recordings"


def connected(app: FastAPI) -> TestClient:
    return TestClient(app, base_url=HOST, raise_server_exceptions=False)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_folder=tmp_path / "data", max_upload_bytes=4 * 2**20, max_recordings=3, max_waiting=1)


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """Work is done within the request that hands it in."""
    with connected(create_app(settings, InlineExecutor())) as client:
        yield client


@pytest.fixture
def executor() -> ManualExecutor:
    return ManualExecutor()


@pytest.fixture
def waiting_client(settings: Settings, executor: ManualExecutor) -> Iterator[TestClient]:
    """Work is done when the test runs the executor."""
    with connected(create_app(settings, executor)) as client:
        yield client


@pytest.fixture(scope="session")
def paper_robot() -> bytes:
    return PAPER_ROBOT.read_bytes()


@pytest.fixture(scope="session")
def paper_recordings(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """Two recordings of the paper's arm, of different motions."""
    folder = tmp_path_factory.mktemp("paper")
    first, second = (write_recording(folder / f"{seed}.csv", seed=seed) for seed in (1, 2))
    return first.read_bytes(), second.read_bytes()


@pytest.fixture
def items(tmp_path: Path) -> ItemStore:
    return ItemStore(tmp_path / "jobs", "job")
