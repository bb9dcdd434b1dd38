"""Files of strangers are read elsewhere: in bounds, fairly, and for nobody who has gone."""

import asyncio
import os
import signal
import time
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.requests import ClientDisconnect, Request
from starlette.testclient import TestClient

from runtime.test_control_process import packages_of
from server.conftest import RECORDINGS, connected
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor
from tauscope.server.auth.gate import CALLER
from tauscope.server.auth.keys import Caller, Scope
from tauscope.server.http import Settings, create_app
from tauscope.server.http.reading import MOST_WAITING_EACH, ReadingQueue
from tauscope.server.problems import ProblemError
from tauscope.server.queue.worker_pool import WorkerPool

LONG_S = 30.0


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    with WorkerPool(2) as pool:
        yield pool


def request_of(name: str, *, is_gone: bool = False) -> Request:
    """A request of a caller."""

    async def receive() -> dict[str, Any]:
        if not is_gone:
            await asyncio.sleep(LONG_S)
        return {"type": "http.disconnect"}

    caller = Caller(name=name, scope=Scope.READ, key=name)
    return Request({"type": "http", "headers": [], CALLER: caller}, receive)


def test_a_process_that_reads_files_begins_without_the_rest_of_the_service() -> None:
    loaded = packages_of("tauscope.server.queue.received_files, tauscope.server.queue.received_files")
    assert not {"fastapi", "starlette", "sqlalchemy", "scipy"} & loaded


def test_work_of_a_client_that_has_gone_is_ended(pool: WorkerPool) -> None:
    async def talk() -> float:
        queue = ReadingQueue(pool)
        began = time.monotonic()
        with pytest.raises(ClientDisconnect):
            await queue.call(request_of("a", is_gone=True), time.sleep, LONG_S)
        assert await queue.call(request_of("a"), os.getpid) != os.getpid()
        assert len(queue) == 0
        return time.monotonic() - began

    assert asyncio.run(talk()) < LONG_S / 2


def test_a_caller_who_asks_for_much_keeps_nobody_else_waiting(pool: WorkerPool) -> None:
    async def talk() -> None:
        queue = ReadingQueue(pool)
        floods = [
            asyncio.create_task(queue.call(request_of("flood"), time.sleep, LONG_S))
            for _ in range(MOST_WAITING_EACH + 1)
        ]
        await asyncio.sleep(0.1)
        with pytest.raises(ProblemError) as refusal:
            await queue.call(request_of("flood"), os.getpid)
        assert (refusal.value.code, refusal.value.status_code) == ("queue-full", 429)
        assert refusal.value.headers == {"Retry-After": "2"}
        assert await asyncio.wait_for(queue.call(request_of("other"), os.getpid), LONG_S / 2)
        for flood in floods:
            flood.cancel()
        await asyncio.wait(floods)
        assert len(queue) == 0

    asyncio.run(talk())


@pytest.mark.usefixtures("reader_processes")
def test_reading_has_a_deadline(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings.model_copy(update={"reading_timeout_s": 0.3})
    monkeypatch.setattr("tauscope.server.queue.received_files.check_kept_recording", wait_for_ever)
    with connected(create_app(settings, InlineExecutor())) as client:
        send(client)
        problem = client.get(f"{RECORDINGS}/a.csv/report")
        assert_problem(problem, "limit-exceeded", 413)
        assert "took longer than the 0.3 s" in problem.json()["detail"]


def send(client: TestClient) -> None:
    assert client.post(RECORDINGS, files={"file": ("a.csv", b"t,q1,tau1\n0,0,0\n")}).status_code == 201


def wait_for_ever(*_: object) -> None:
    signal.pause()
