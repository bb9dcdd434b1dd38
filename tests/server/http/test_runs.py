"""Runs over HTTP: begun, followed, stopped whatever is stuck, their recordings fetched."""

import json
import threading
from collections.abc import Callable, Iterator
from functools import partialmethod
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.event_stream import read_events
from server.http.motions import ROBOT, ROBOT_FILE, move_csv, move_document
from server.http.problem_check import assert_problem
from server.queue.controls import CSV, WAY, HandControls
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from tauscope.runtime.record import RunProblem
from tauscope.runtime.states import RunState
from tauscope.server.control.run import RunWorkspace
from tauscope.server.http import Settings, create_app
from tauscope.server.http.protection import ConcurrencyLimiter
from tauscope.server.http.tasks import event_feeds
from tauscope.server.queue.analyses import ExcitationWorkspace
from tauscope.server.store.files import KeptFile
from tauscope.server.store.recordings import RecordingStore, StoredRecording

RUNS, EXCITATIONS = "/api/v1/runs", "/api/v1/excitations"


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def arm(settings: Settings, controls: HandControls) -> Iterator[TestClient]:
    """Runs go on as the test says; jobs are done at once. What still goes on in the end is stopped."""
    with connected(create_app(settings, InlineExecutor(), controls)) as client:
        try:
            yield client
        finally:
            controls.obey_from_now_on()


def begin(client: TestClient, **changes: Any) -> dict[str, Any]:
    answer = client.post(RUNS, json={"robot": ROBOT, "trajectory": move_document(), **changes})
    assert answer.status_code == 202, answer.text
    assert answer.headers["location"] == answer.json()["links"]["self"]
    return answer.json()


def ended(client: TestClient, run: dict[str, Any]) -> dict[str, Any]:
    def is_told() -> bool:
        answer = client.get(run["links"]["recordings"].get("csv", f"{run['links']['self']}/recording"))
        return answer.status_code != 409

    wait_until(is_told)
    return client.get(run["links"]["self"]).json()


def test_a_run_from_its_beginning_to_its_recording(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm, mode="torque", rate_hz=250.0, stop_policy="damp")
    assert run["options"]["mode"] == "torque"
    assert (run["options"]["rate_hz"], run["options"]["stop_policy"]) == (250.0, "damp")
    assert run["backend"] == {"name": "sim", "time": "virtual", "scenario": None, "keep_settings": False, "start": None}
    control = controls.next()
    control.go(RunState.RUNNING)
    control.progress(40.0)
    status = arm.get(run["links"]["self"]).json()
    assert (status["state"], status["percent"], status["figures"]["missed_periods"]) == ("running", 40.0, 3)
    assert status["links"]["recordings"] == {}
    control.finish()
    status = ended(arm, run)
    assert (status["state"], status["percent"], status["problem"]) == ("finished", 100.0, None)
    assert status["created"] <= status["ended"]
    name = f"run-{run['id']}.csv"
    assert status["recording"]["name"] == name
    assert set(status["links"]["recordings"]) == {"mcap", "csv"}
    csv = arm.get(status["links"]["recordings"]["csv"])
    assert (csv.text, csv.headers["content-type"].partition(";")[0]) == (CSV, "text/csv")
    assert csv.headers["content-disposition"] == f'attachment; filename="{name}"'
    assert arm.get(status["links"]["recordings"]["mcap"]).content == b"journal"
    detail = assert_problem(arm.get(f"{RUNS}/{run['id']}/recording?format=parquet"), "not-found", 404)["detail"]
    assert "mcap, csv" in detail
    assert name in [entry["name"] for entry in arm.get(RECORDINGS).json()["recordings"]]
    assert arm.get(f"{RECORDINGS}/{name}/content").text == CSV
    assert [entry["id"] for entry in arm.get(RUNS).json()["runs"]] == [run["id"]]


def test_an_identification_takes_the_recording_of_a_run_by_its_name(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    controls.next().finish()
    name = ended(arm, run)["recording"]["name"]
    answer = arm.post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": [name]})
    assert [entry["origin"] for entry in answer.json()["recordings"]] == ["server"]


def test_the_events_of_a_run(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    control = controls.next()
    control.go(RunState.RUNNING)
    control.progress(40.0)
    control.finish()
    ended(arm, run)
    told = list(read_events(arm.get(run["links"]["events"]).text.split("\n")))
    assert [event.kind for event in told] == ["state"] * 4 + ["progress", "state", "ended"]
    assert [event.data.get("state") for event in told if event.kind != "progress"] == [*WAY, "stopping", "finished"]
    assert told[4].data["percent"] == 40.0
    rest = arm.get(run["links"]["events"], headers={"Last-Event-ID": "5"}).text
    assert list(read_events(rest.split("\n"))) == told[5:]
    assert arm.get(run["links"]["events"], headers={"Last-Event-ID": "7"}).status_code == 204


def test_the_end_is_told_when_everything_is_in_its_place(
    arm: TestClient, controls: HandControls, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(event_feeds, "LAST_WAIT_S", 0.0)
    keep, go_on = RecordingStore.keep, threading.Event()

    def slowly(self: RecordingStore, file: KeptFile) -> tuple[StoredRecording, bool]:
        go_on.wait(0.5)
        return keep(self, file)

    monkeypatch.setattr(RecordingStore, "keep", slowly)
    run = begin(arm)
    controls.next().finish()
    (*_, last) = read_events(arm.get(run["links"]["events"]).text.split("\n"))
    assert (last.kind, last.data["state"]) == ("ended", "finished")
    assert arm.get(run["links"]["self"]).json()["recording"]["name"] is not None


@pytest.mark.parametrize("state", WAY)
def test_stop_in_every_state_and_again(state: RunState, arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    control = controls.next()
    control.go(state)
    for _ in range(2):
        answer = arm.post(run["links"]["stop"])
        assert (answer.status_code, answer.json()) == (202, {"id": run["id"], "state": state.value})
    assert control.stops == 2
    control.finish(RunState.STOPPED)
    assert ended(arm, run)["state"] == "stopped"
    answer = arm.post(run["links"]["stop"])
    assert (answer.status_code, answer.json()["state"]) == (202, "stopped")
    assert control.stops == 2


def test_stop_works_while_everything_else_is_stuck(
    settings: Settings, controls: HandControls, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The jobs hang, every thread that routes run in is taken, the disk takes nothing, and all locks are held."""
    executor, stuck, let_go = ManualExecutor(), threading.Semaphore(0), threading.Event()
    freed: list[bool] = []

    def hang(*_: object, **__: object) -> None:
        stuck.release()
        freed.append(let_go.wait(60.0))

    impatient = partialmethod(ConcurrencyLimiter.__init__, slot_timeout_s=0.02)  # the readers that hang lose their slot
    monkeypatch.setattr(ConcurrencyLimiter, "__init__", impatient)
    app = create_app(settings, executor, controls)
    with connected(app) as client:
        answer = begin(client)
        control = controls.next()
        control.go(RunState.RUNNING)
        services = app.state.services
        monkeypatch.setattr(services.items["identification"], "identifiers", hang)
        monkeypatch.setattr(RunWorkspace, "read_record", hang)
        threads = [threading.Thread(target=lambda: client.get(IDENTIFICATIONS)) for _ in range(45)]
        for thread in threads:
            thread.start()
        for _ in range(40):  # as many as there are threads for routes
            assert stuck.acquire(timeout=60.0)
        with services.jobs._lock, services.runs._lock, services.runs._registering, services.runs.claims._lock:
            stop = client.post(answer["links"]["stop"])
        assert (stop.status_code, stop.json()["state"]) == (202, "running")
        assert control.stops == 1
        assert freed == []  # all of it was stuck until now
        monkeypatch.undo()
        let_go.set()
        for thread in threads:
            thread.join(60.0)
        control.finish(RunState.STOPPED)


def test_an_arm_has_one_run_at_a_time(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    answer = arm.post(RUNS, json={"robot": ROBOT, "trajectory": move_document()})
    problem = assert_problem(answer, "busy", 409)
    assert f"run {run['id']} has it" in problem["detail"]
    assert answer.headers["retry-after"] == "10"
    controls.next().finish()
    ended(arm, run)
    begin(arm)


def test_a_run_that_goes_on_has_no_recording_and_is_not_removed(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    assert_problem(arm.get(f"{RUNS}/{run['id']}/recording"), "not-finished", 409)
    assert_problem(arm.delete(f"{RUNS}/{run['id']}"), "not-finished", 409)
    controls.next().finish(RunState.FAILED, RunProblem(code="acquisition", detail="joint1: too fast"), csv="")
    wait_until(lambda: arm.delete(f"{RUNS}/{run['id']}").status_code == 204)
    assert_problem(arm.get(f"{RUNS}/{run['id']}"), "not-found", 404)


def test_a_run_that_failed_says_why(arm: TestClient, controls: HandControls) -> None:
    run = begin(arm)
    controls.next().finish(RunState.FAILED, RunProblem(code="acquisition", detail="joint1: too fast"), csv="")
    status = ended(arm, run)
    assert status["state"] == "failed"
    assert (status["problem"]["code"], status["problem"]["detail"]) == ("acquisition", "joint1: too fast")
    assert status["problem"]["type"] == "/docs/errors/acquisition"
    assert status["recording"] is None


@pytest.mark.parametrize("file", ["control/run.json", "request.json"])
def test_a_damaged_run_is_shown_as_damaged(
    file: str, arm: TestClient, controls: HandControls, settings: Settings
) -> None:
    run = begin(arm)
    controls.next().finish()
    ended(arm, run)
    (settings.data_folder / "runs" / run["id"] / file).write_bytes(b"\0\1")
    (listed,) = arm.get(RUNS).json()["runs"]
    assert (listed["state"], listed["problem"]["code"]) == ("damaged", "damaged")


@pytest.mark.parametrize(
    "parts",
    [
        {"robot": ("arm.yaml", ROBOT_FILE), "trajectory": ("move.csv", move_csv())},
        {"robot": ("arm.yaml", ROBOT_FILE), "trajectory": ("move.json", json.dumps(move_document()).encode())},
    ],
    ids=["csv", "json"],
)
def test_robot_and_trajectory_as_files(
    parts: dict[str, tuple[str, bytes]], arm: TestClient, controls: HandControls, settings: Settings
) -> None:
    answer = arm.post(RUNS, files=parts, data={"request": json.dumps({"rate_hz": 100.0})})
    assert answer.status_code == 202, answer.text
    workspace = RunWorkspace(settings.data_folder / "runs" / answer.json()["id"])
    assert workspace.trajectory is not None
    assert workspace.trajectory.name == parts["trajectory"][0]
    assert answer.json()["links"]["excitation"] is None
    controls.next()


def with_nan(document: dict[str, Any]) -> dict[str, Any]:
    document["segments"][0]["end"] = [0.3, "x"]
    return document


WITH_DATA_SHEET = {**ROBOT, "joints": [{"name": "joint1"}, {"name": "joint2", "drive": {"eds": "/etc/hosts"}}]}


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ({}, "invalid-request", "no robot was sent"),
        ({"robot": ROBOT, "trajectory": {}}, "excitation", "trajectory.json: robot: field required"),
        ({"robot": ROBOT, "trajectory": with_nan(move_document())}, "excitation", "segments[0].end[1]"),
        ({"robot": ROBOT, "trajectory": move_document(), "excitation": "x"}, "invalid-request", "give one motion"),
        ({"robot": ROBOT, "mode": "speed"}, "invalid-request", "body.mode"),
        ({"robot": ROBOT, "rate_hz": 0}, "invalid-request", "body.rate_hz"),
        ({"robot": ROBOT, "rate_hz": "100"}, "invalid-request", "body.rate_hz"),
        ({"robot": ROBOT, "stop_policy": "let go"}, "invalid-request", "body.stop_policy"),
        ({"robot": ROBOT, "backend": {"name": "real"}}, "invalid-request", "body.backend.name"),
        ({"robot": ROBOT, "backend": "sim"}, "invalid-request", "body.backend"),
        ({"robot": ROBOT, "backend": {"scenario": []}}, "invalid-request", "body.backend.scenario"),
        ({"robot": ROBOT, "speed": 1}, "invalid-request", "body.speed"),
        ({"robot": {**ROBOT, "name": 7}}, "robot-file", "robot: name"),
        ({"robot": WITH_DATA_SHEET, "backend": {"name": "canopen"}}, "robot-file", "joint2: drive.eds names a file"),
    ],
)
def test_requests_that_are_refused(
    body: dict[str, Any], code: str, words: str, arm: TestClient, settings: Settings, controls: HandControls
) -> None:
    problem = assert_problem(arm.post(RUNS, json=body), code, 422)
    assert words in problem["detail"] + str(problem.get("errors"))
    assert list((settings.data_folder / "runs").iterdir()) == []
    assert list((settings.data_folder / "excitations").iterdir()) == []
    assert controls.started == []


def test_a_trajectory_of_another_robot(arm: TestClient) -> None:
    kinematics = {"dh": [{"theta": 0.0, "d": 0.0, "a": 0.5, "alpha": 0.0}]}
    robot = {"name": "one", "kinematics": kinematics, "model": {"links": ROBOT["model"]["links"][:1]}}
    answer = arm.post(RUNS, json={"robot": robot, "trajectory": move_document()})
    assert "2 joints" in assert_problem(answer, "excitation", 422)["detail"]


def test_an_excitation_that_is_not_there(arm: TestClient) -> None:
    assert_problem(arm.post(RUNS, json={"robot": ROBOT, "excitation": "nothing"}), "not-found", 404)


@pytest.fixture
def waiting_arm(settings: Settings, controls: HandControls, executor: ManualExecutor) -> Iterator[TestClient]:
    """Jobs are done when the test says so."""
    with connected(create_app(settings, executor, controls)) as client:
        yield client
        controls.obey_from_now_on()


def finish_design(settings: Settings, executor: ManualExecutor, identifier: str) -> None:
    """Let a design end with a motion that the test knows."""
    workspace = ExcitationWorkspace(settings.data_folder / "excitations" / identifier)
    workspace.trajectory.write_text(json.dumps(move_document()), encoding="utf-8")
    future, _ = executor.tasks.pop(0)
    future.set_running_or_notify_cancel()
    future.set_result(None)


def test_without_a_motion_the_default_one_is_designed_first(
    waiting_arm: TestClient, controls: HandControls, executor: ManualExecutor, settings: Settings
) -> None:
    run = waiting_arm.post(RUNS, json={"robot": ROBOT}).json()
    wait_until(lambda: waiting_arm.get(run["links"]["self"]).json()["step"] == "design the motion")
    assert waiting_arm.get(run["links"]["self"]).json()["state"] == "created"
    excitation = waiting_arm.get(run["links"]["excitation"]).json()
    assert (excitation["state"], excitation["options"]["duration_s"]) == ("running", 10.0)
    assert controls.started == []
    finish_design(settings, executor, excitation["id"])
    controls.next().finish()
    assert ended(waiting_arm, run)["state"] == "finished"
    # The same motion again, and its robot with it.
    again = waiting_arm.post(RUNS, json={"excitation": excitation["id"]}).json()
    assert (again["robot"], again["links"]["excitation"]) == ("two-joint-arm", run["links"]["excitation"])
    controls.next(2).finish(csv="# again\n" + CSV)
    ended(waiting_arm, again)


def test_stop_while_its_motion_is_designed(
    waiting_arm: TestClient, controls: HandControls, executor: ManualExecutor
) -> None:
    run = waiting_arm.post(RUNS, json={"robot": ROBOT}).json()
    waiting_arm.post(run["links"]["stop"])
    assert ended(waiting_arm, run)["state"] == "stopped"
    assert waiting_arm.get(run["links"]["excitation"]).json()["state"] == "cancelled"
    assert controls.started == []


def test_an_excitation_that_has_not_ended_is_no_motion_yet(waiting_arm: TestClient, controls: HandControls) -> None:
    excitation = waiting_arm.post(EXCITATIONS, json={"robot": ROBOT}).json()
    answer = waiting_arm.post(RUNS, json={"robot": ROBOT, "excitation": excitation["id"]})
    assert_problem(answer, "not-finished", 409)
    assert controls.started == []


def test_no_design_is_begun_for_a_run_that_is_refused(waiting_arm: TestClient, settings: Settings) -> None:
    first = waiting_arm.post(RUNS, json={"robot": ROBOT}).json()
    assert_problem(waiting_arm.post(RUNS, json={"robot": ROBOT}), "busy", 409)
    states = [entry["state"] for entry in waiting_arm.get(EXCITATIONS).json()["excitations"]]
    assert states == ["running"]
    waiting_arm.post(first["links"]["stop"])
    ended(waiting_arm, first)


def test_the_end_of_the_service_stops_the_arm_first(
    settings: Settings, controls: HandControls, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    executor = InlineExecutor()
    monkeypatch.setattr(executor, "shutdown", lambda *_, **__: order.append("jobs"))

    def obey() -> None:
        control = controls.next()
        assert control.when_stopped()
        order.append("arm")
        control.finish(RunState.STOPPED)

    thread = threading.Thread(target=obey)
    thread.start()
    with connected(create_app(settings, executor, controls)) as client:
        run = begin(client)
        controls.next()  # a run whose control never started has no arm to stop
    thread.join(20.0)
    assert order[0] == "arm"
    with connected(create_app(settings, InlineExecutor(), controls)) as client:
        assert client.get(run["links"]["self"]).json()["state"] == "stopped"


@pytest.mark.parametrize("call", ["get", "delete"])
def test_what_is_not_there(call: str, arm: TestClient) -> None:
    request: Callable[[str], Any] = getattr(arm, call)
    assert_problem(request(f"{RUNS}/nothing"), "not-found", 404)
    assert_problem(arm.post(f"{RUNS}/nothing/stop"), "not-found", 404)
    assert_problem(arm.get(f"{RUNS}/nothing/recording"), "not-found", 404)
    assert_problem(arm.get(f"{RUNS}/nothing/events"), "not-found", 404)
