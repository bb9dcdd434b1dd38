"""Events of a job over HTTP: complete, resumed where they broke off, ended with the job."""

import asyncio
import threading
import time
from pathlib import Path
from typing import Any, cast

import pytest
from fastapi import Request
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, connected
from server.http.event_stream import Event, read_events
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor, ManualExecutor
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services
from tauscope.server.http.tasks import router as event_routes
from tauscope.server.http.tasks.event_feeds import EventFeeds
from tauscope.server.queue.job_folder import JobRecord, JobState, Workspace
from tauscope.server.store.data_folder import utc_now


@pytest.fixture
def files(paper_robot: bytes) -> list[Any]:
    broken = b"t,q1,q2,q3,tau1,tau2,tau3\n0,0,0,0,0,0\n"
    return [("robot", ("arm.yaml", paper_robot)), ("recordings", ("broken.csv", broken))]


def events(client: TestClient, here: str, after: int | None = None) -> list[Event]:
    headers = {} if after is None else {"Last-Event-ID": str(after)}
    answer = client.get(f"{here}/events", headers=headers)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.headers["cache-control"] == "no-store"
    return list(read_events(answer.text.split("\n")))


def test_everything_that_happened_is_told_in_order(client: TestClient, files: list[Any]) -> None:
    accepted = client.post(IDENTIFICATIONS, files=files).json()
    told = events(client, accepted["links"]["self"])
    assert [event.id for event in told] == [str(number) for number in range(1, len(told) + 1)]
    assert [event.kind for event in told] == ["state", "state", "step", "ended"]
    assert all(event.data["kind"] == event.kind for event in told)
    assert [event.data.get("state") for event in told] == ["queued", "running", None, "failed"]
    assert told[-1].data["problem"]["detail"].startswith("broken.csv: line 2")
    times = [event.data["time"] for event in told]
    assert times == sorted(times)
    assert accepted["links"]["events"] == f"{accepted['links']['self']}/events"


def test_a_client_that_was_cut_off_gets_the_rest(client: TestClient, files: list[Any]) -> None:
    here = client.post(IDENTIFICATIONS, files=files).headers["location"]
    told = events(client, here)
    for known in range(len(told)):
        assert events(client, here, after=known) == told[known:]


def test_who_knows_the_end_is_told_not_to_come_back(client: TestClient, files: list[Any]) -> None:
    here = client.post(IDENTIFICATIONS, files=files).headers["location"]
    for known in (4, 5, 2**53):
        answer = client.get(f"{here}/events", headers={"Last-Event-ID": str(known)})
        assert (answer.status_code, answer.content) == (204, b"")


def test_events_outlive_the_service(settings: Settings, files: list[Any], executor: ManualExecutor) -> None:
    with connected(create_app(settings, executor)) as client:
        here = client.post(IDENTIFICATIONS, files=files).headers["location"]
    with connected(create_app(settings, InlineExecutor())) as client:
        told = events(client, here)
        states = [event.data["state"] for event in told if "state" in event.data]
        assert states == ["queued", "running", "queued", "running", "failed"]
        assert events(client, here, after=2) == told[2:]


def test_a_job_of_the_time_before_there_were_events(settings: Settings, files: list[Any]) -> None:
    with connected(create_app(settings, InlineExecutor())) as client:
        status = client.post(IDENTIFICATIONS, files=files).json()
    (settings.data_folder / "identifications" / status["id"] / "events.jsonl").unlink()
    with connected(create_app(settings, InlineExecutor())) as client:
        (only,) = events(client, status["links"]["self"])
    assert (only.id, only.kind, only.data["state"]) == ("1", "ended", "failed")


@pytest.mark.parametrize("damage", ["the end is missing", "the state is damaged"])
def test_a_stream_ends_also_where_files_are_damaged(
    damage: str, client: TestClient, settings: Settings, files: list[Any]
) -> None:
    status = client.post(IDENTIFICATIONS, files=files).json()
    folder: Path = settings.data_folder / "identifications" / status["id"]
    if damage == "the end is missing":
        log = Workspace(folder).events.path
        log.write_bytes(log.read_bytes()[:-20])
    else:
        (folder / "state.json").write_bytes(b"\0")
    told = events(client, status["links"]["self"])
    assert [event.kind for event in told[:3]] == ["state", "state", "step"]


def test_what_work_does_after_it_was_cancelled_is_not_told(
    waiting_client: TestClient, settings: Settings, executor: ManualExecutor, files: list[Any]
) -> None:
    status = waiting_client.post(IDENTIFICATIONS, files=files).json()
    waiting_client.delete(status["links"]["self"])
    Workspace(settings.data_folder / "identifications" / status["id"]).write_step("too late")
    executor.run()
    told = events(waiting_client, status["links"]["self"])
    assert [event.data.get("state") for event in told] == ["queued", "running", "cancelled"]


def test_what_is_not_there_has_no_events(client: TestClient) -> None:
    assert_problem(client.get(f"{IDENTIFICATIONS}/nothing/events"), "not-found", 404)


@pytest.mark.parametrize("known", ["-1", "x", "1.5", "9" * 30])
def test_a_last_event_that_is_no_number(known: str, client: TestClient, files: list[Any]) -> None:
    here = client.post(IDENTIFICATIONS, files=files).headers["location"]
    answer = client.get(f"{here}/events", headers={"Last-Event-ID": known})
    problem = assert_problem(answer, "invalid-request", 422)
    assert problem["errors"][0]["field"] == "header.Last-Event-ID"


class _Caller:
    """A client that is there until it is gone."""

    def __init__(self) -> None:
        self.is_gone = False

    async def is_disconnected(self) -> bool:
        return self.is_gone


@pytest.mark.parametrize("end", ["the service ends", "the client is gone"])
def test_a_quiet_stream_lives_by_comments_and_ends_with_service_or_client(
    end: str, settings: Settings, executor: ManualExecutor, files: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(event_routes, "HEARTBEAT_S", 0.0)
    monkeypatch.setattr(event_routes, "PRESENCE_S", 0.001)
    monkeypatch.setattr("tauscope.server.http.tasks.event_feeds.POLL_S", 0.001)
    app, caller = create_app(settings, executor), _Caller()
    with connected(app) as client:
        status = client.post(IDENTIFICATIONS, files=files).json()
        services: Services = app.state.services

        async def listen() -> list[bytes]:
            workspace = Workspace(settings.data_folder / "identifications" / status["id"])
            feeds = EventFeeds(services.closing)
            heard: list[bytes] = []
            async for piece in event_routes._stream(cast(Request, caller), feeds, workspace, 0):
                heard.append(piece)
                if piece.startswith(b":") and any(each.startswith(b"event") for each in heard):
                    caller.is_gone = end == "the client is gone"
                    services.closing.set() if end == "the service ends" else None
            return heard

        heard = asyncio.run(listen())
    assert heard[0] == b"retry: 1000\n\n"
    told = [piece for piece in heard[1:] if not piece.startswith(b":")]
    assert told[0].startswith(b"event: state\n")
    assert heard[-1] == b": ping\n\n"


def test_a_thousand_streams_are_told_within_a_second(tmp_path: Path) -> None:
    """Ten jobs, followed by a hundred clients each: the logs are read ten times a round, not a thousand times."""
    workspaces = [Workspace(tmp_path / str(number)) for number in range(10)]
    for workspace in workspaces:
        workspace.folder.mkdir()
        workspace.write_record(JobRecord(state=JobState.QUEUED, created=utc_now()))

    async def listen(feeds: EventFeeds, workspace: Workspace) -> float:
        async for piece in event_routes._stream(cast(Request, _Caller()), feeds, workspace, 0):
            if b"event: ended" in piece:
                return time.monotonic()
        raise AssertionError("the stream ended before the job was told to have ended")

    async def follow() -> float:
        feeds = EventFeeds(threading.Event())
        streams = [asyncio.create_task(listen(feeds, workspaces[number % 10])) for number in range(1000)]
        await asyncio.sleep(0.5)
        for workspace in workspaces:
            record = workspace.read_record()
            assert record is not None
            workspace.write_record(record.moved(JobState.CANCELLED, utc_now()))
        told = time.monotonic()
        return max(await asyncio.gather(*streams)) - told

    assert asyncio.run(follow()) < 1.0
