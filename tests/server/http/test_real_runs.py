"""Runs of the simulated arm through the service as it is run: control processes, event streams, restarts."""

import json
import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

from server.conftest import RECORDINGS
from server.http.event_stream import Event, read_events
from server.http.serving import Served, served
from server.queue.paper_files import PAPER_ROBOT
from server.queue.waiting import wait_until
from tauscope.recording import read_recording
from tauscope.trajectory import Trajectory, trajectory_json
from tauscope.trajectory.segments import MoveSegment

pytestmark = pytest.mark.slow

RUNS = "/api/v1/runs"
LONG_S = 600.0
START = [0.0, 0.6, 0.6]


def swing(duration_s: float) -> bytes:
    """A slow move of the paper's arm."""
    move = MoveSegment(np.array(START), np.array([0.5, 1.0, 0.0]), duration_s)
    return trajectory_json(Trajectory("paper-arm", ("joint1", "joint2", "joint3"), (move,))).encode()


def begin(client: httpx2.Client, duration_s: float, **request: Any) -> dict[str, Any]:
    request = {"backend": {"start": START}, **request}
    files = {"robot": ("arm.yaml", PAPER_ROBOT.read_bytes()), "trajectory": ("swing.json", swing(duration_s))}
    answer = client.post(RUNS, files=files, data={"request": json.dumps(request)})
    assert answer.status_code == 202, answer.text
    return answer.json()


def follow(client: httpx2.Client, run: dict[str, Any], after: int = 0) -> Iterator[Event]:
    with client.stream("GET", run["links"]["events"], headers={"Last-Event-ID": str(after)}) as answer:
        assert answer.status_code == 200
        yield from read_events(answer.iter_lines())


def follow_until_progress(client: httpx2.Client, run: dict[str, Any]) -> list[Event]:
    """What is told of a run up to its first progress in the motion itself: from then on it has recorded something."""
    told: list[Event] = []
    state = None
    for event in follow(client, run):
        told.append(event)
        state = event.data.get("state", state)
        if (event.kind, state) == ("progress", "running"):
            break
    return told


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("runs") / "data") as service:
        yield service


def test_a_run_and_its_events(service: Served) -> None:
    client = service.client
    run = begin(client, 2.0, rate_hz=200.0, backend={"scenario": {"torque_noise_std": 0.1}, "start": START})
    told = list(follow(client, run))
    assert [event.id for event in told] == [str(number) for number in range(1, len(told) + 1)]
    states = [event.data["state"] for event in told if event.kind in ("state", "ended")]
    assert states == ["connecting", "enabling", "ramping", "running", "stopping", "finished"]
    status = client.get(run["links"]["self"]).json()
    assert (status["state"], status["timing"]["rate_hz"], status["timing"]["missed_periods"]) == ("finished", 200.0, 0)
    assert status["recording"]["samples"] == pytest.approx(400, abs=5)
    for link in status["links"]["recordings"].values():
        assert len(client.get(link).content) > 10_000
    report = client.get(f"{RECORDINGS}/{status['recording']['name']}/report", params={"joint_count": 3}).json()
    assert report["samples"] == status["recording"]["samples"]
    assert client.get(f"{RECORDINGS}/{status['recording']['name']}/content").status_code == 200


def test_a_stream_that_breaks_off_goes_on_where_it_ended(service: Served) -> None:
    client = service.client
    run = begin(client, LONG_S, rate_hz=200.0)
    first = follow_until_progress(client, run)
    assert client.post(run["links"]["stop"]).status_code == 202
    rest = list(follow(client, run, after=int(first[-1].id)))
    assert (rest[-1].kind, rest[-1].data["state"]) == ("ended", "stopped")
    assert first + rest == list(follow(client, run))
    status = client.get(run["links"]["self"]).json()
    assert status["state"] == "stopped"
    assert status["recording"]["partial"]
    assert 0 < status["percent"] < 100


def test_followers_that_are_gone_leave_nothing_behind(service: Served) -> None:
    def open_files() -> int:
        return len(os.listdir(f"/proc/{service.process.pid}/fd"))

    client = service.client
    run = begin(client, LONG_S, rate_hz=200.0)
    wait_until(lambda: is_running(client, run))
    with ExitStack() as streams:
        readers = []
        for _ in range(20):
            other = streams.enter_context(httpx2.Client(base_url=client.base_url, timeout=60))
            answer = streams.enter_context(other.stream("GET", run["links"]["events"]))
            readers.append(answer.iter_lines())
            assert next(readers[-1])
        during = open_files()
        assert during > 20
    wait_until(lambda: open_files() <= during - 20)
    assert client.post(run["links"]["stop"]).status_code == 202  # the arm may be stopping by the time it is answered
    (*_, last) = follow(client, run)
    assert last.data["state"] == "stopped"


def test_a_run_that_cannot_begin(service: Served) -> None:
    client = service.client
    run = begin(client, 2.0, backend={"scenario": {"torque_noise": 1.0}})
    (*_, last) = follow(client, run)
    assert last.data["problem"]["code"] == "scenario"
    assert "torque_noise" in last.data["problem"]["detail"]
    assert "/" not in last.data["problem"]["detail"]
    run = begin(client, 2.0, backend={"name": "canopen"})
    (*_, last) = follow(client, run)
    assert (last.data["state"], last.data["problem"]["code"]) == ("failed", "acquisition")


def control_process(folder: Path) -> int:
    return json.loads((folder / "control" / "run.json").read_bytes())["control"]["pid"]


def is_running(client: httpx2.Client, run: dict[str, Any]) -> bool:
    return client.get(run["links"]["self"]).json()["state"] == "running"


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_a_service_that_ends_leaves_no_arm_moving(end: signal.Signals, tmp_path: Path) -> None:
    runs = tmp_path / "data" / "runs"
    with served(tmp_path / "data") as service:
        run = begin(service.client, LONG_S, rate_hz=200.0)
        known = follow_until_progress(service.client, run)
        control = control_process(runs / run["id"])
        service.process.send_signal(end)
        service.process.wait(60)
    wait_until(lambda: not os.path.exists(f"/proc/{control}"))
    with served(tmp_path / "data") as service:
        status = service.client.get(run["links"]["self"]).json()
        assert status["state"] == ("stopped" if end is signal.SIGTERM else "interrupted")
        assert status["recording"]["samples"] > 0
        told = list(follow(service.client, run))
        assert told[: len(known)] == known
        assert (told[-1].kind, told[-1].data["state"]) == ("ended", status["state"])
        name = f"run-{run['id']}.csv"
        assert name in [entry["name"] for entry in service.client.get(RECORDINGS).json()["recordings"]]
    assert len(read_recording(tmp_path / "data" / "recordings" / name)) == status["recording"]["samples"]


@pytest.mark.slow
def test_a_control_process_that_dies_is_told(service: Served) -> None:
    client = service.client
    run = begin(client, LONG_S, rate_hz=200.0)
    wait_until(lambda: is_running(client, run))
    folder = Path(str(service.process.args[3])) / "runs" / run["id"]  # type: ignore[index]
    journal = folder / "control" / "journal.mcap"
    ramp = journal.stat().st_size
    wait_until(lambda: journal.stat().st_size > ramp + 10_000)
    os.kill(control_process(folder), signal.SIGKILL)
    (*_, last) = follow(client, run)
    assert (last.kind, last.data["state"]) == ("ended", "interrupted")
    assert client.get(run["links"]["self"]).json()["recording"]["samples"] > 0
