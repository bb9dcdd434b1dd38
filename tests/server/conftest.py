"""The service in this process: work is done at once, or when a test says so."""

import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.routing import BaseRoute
from starlette.testclient import TestClient

from databases import address, database, postgres
from excitation.excited_arms import short_search
from figures import leave_figures_undrawn
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.paper_files import PAPER_ROBOT, write_recording
from tauscope.server.http import Settings, create_app
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.database.database import FILE_NAME, Database

__all__ = ["address", "database", "postgres"]

HOST = "http://127.0.0.1:8000"
IDENTIFICATIONS = "/api/v1/identifications"
RECORDINGS = "/api/v1/recordings"


@cache
def prepared_routes() -> list[BaseRoute]:
    """The routes of one application, for all: FastAPI prepares them at an application's first request, within 40 ms."""
    return create_app(Settings(data_folder=Path())).router.routes


def connected(app: FastAPI) -> TestClient:
    app.router.routes[:] = prepared_routes()
    return TestClient(app, base_url=HOST, raise_server_exceptions=False)


@pytest.fixture(scope="session")
def new_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of the present form, to be copied: to take all the steps to it takes 30 ms each time."""
    path = tmp_path_factory.mktemp("new") / FILE_NAME
    Database(path).close()
    return path


def make_data_folder(folder: Path, new_database: Path) -> Path:
    folder.mkdir(parents=True)
    shutil.copy(new_database, folder / FILE_NAME)
    return folder


@pytest.fixture(autouse=True)
def undrawn_figures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports have empty figures, unless a test asks for `drawn_figures`: Matplotlib takes a second per report."""
    if "drawn_figures" in request.fixturenames:
        return
    leave_figures_undrawn(monkeypatch)


@pytest.fixture(autouse=True)
def inline_readers(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are read in this process, unless a test asks for `reader_processes`: to start them takes a second."""
    if "reader_processes" not in request.fixturenames:
        monkeypatch.setattr("tauscope.server.http.services.open_readers", lambda _: InlineExecutor())


@pytest.fixture(autouse=True, scope="module")
def quick_designs() -> Iterator[None]:
    """Motions are designed within a few iterations."""
    with short_search():
        yield


@pytest.fixture
def reader_processes() -> None:
    """Files are read in processes of their own."""


@pytest.fixture
def drawn_figures() -> None:
    """Figures are drawn as a user's are."""


@pytest.fixture
def settings(tmp_path: Path, new_database: Path) -> Settings:
    folder = make_data_folder(tmp_path / "data", new_database)
    return Settings(data_folder=folder, max_upload_bytes=4 * 2**20, max_recordings=3, max_waiting=1)


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """Work is done within the request that hands it in."""
    with connected(create_app(settings, InlineExecutor())) as client:
        yield client


@pytest.fixture(scope="module")
def module_settings(tmp_path_factory: pytest.TempPathFactory, new_database: Path) -> Settings:
    folder = make_data_folder(tmp_path_factory.mktemp("service") / "data", new_database)
    return Settings(data_folder=folder, max_upload_bytes=4 * 2**20, max_recordings=3, max_waiting=1)


@pytest.fixture(scope="module")
def module_client(module_settings: Settings) -> Iterator[TestClient]:
    """One service for all tests of a module: for requests that change nothing or are refused."""
    with connected(create_app(module_settings, InlineExecutor())) as client:
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
