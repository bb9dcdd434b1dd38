"""The service in this process: work is done at once, or when a test says so."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from databases import address, database, postgres
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.paper_files import PAPER_ROBOT, write_recording
from tauscope.report import diagnosis_report, identification_report
from tauscope.server.http import Settings, create_app
from tauscope.server.store.items import ItemStore

__all__ = ["address", "database", "diagnosis_report", "identification_report", "postgres"]

HOST = "http://127.0.0.1:8000"
IDENTIFICATIONS = "/api/v1/identifications"
RECORDINGS = "/api/v1/recordings"


def connected(app: FastAPI) -> TestClient:
    return TestClient(app, base_url=HOST, raise_server_exceptions=False)


@pytest.fixture(autouse=True)
def undrawn_figures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports have empty figures, unless a test asks for `drawn_figures`: Matplotlib takes a second per report."""
    if "drawn_figures" in request.fixturenames:
        return
    for name, module in list(sys.modules.items()):
        if name.startswith("tauscope.report.") and hasattr(module, "draw_svg"):
            monkeypatch.setattr(module, "draw_svg", lambda *_: "<svg></svg>")


@pytest.fixture
def drawn_figures() -> None:
    """Figures are drawn as a user's are."""


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_folder=tmp_path / "data", max_upload_bytes=4 * 2**20, max_recordings=3, max_waiting=1)


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """Work is done within the request that hands it in."""
    with connected(create_app(settings, InlineExecutor())) as client:
        yield client


@pytest.fixture(scope="module")
def module_settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    folder = tmp_path_factory.mktemp("service") / "data"
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
