"""Metrics: what was done is counted, loops as they are timed, and the names of things without number are no labels."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from prometheus_client.parser import text_string_to_metric_families
from starlette.testclient import TestClient

from identified import candidate, identified
from server.auth.keyed import client_with
from server.conftest import HOST
from server.http.motions import ROBOT, move_document
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from snapshots import SNAPSHOTS, unpacked
from tauscope.runtime.states import RunState
from tauscope.runtime.timing import Timing
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services

RUNS = "/api/v1/runs"
MOTION = {"robot": ROBOT, "trajectory": move_document()}
TIMING = Timing(
    rate_hz=500.0,
    achieved_rate_hz=499.0,
    cycles=110,
    missed_periods=7,
    stale_samples=(2, 3),
    lateness_us={"p50": 8.0},
    histogram_us=((10.0, 100), (20.0, 9), (None, 1)),
)


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def app(settings: Settings, controls: HandControls) -> Iterator[FastAPI]:
    app = create_app(settings, InlineExecutor(), controls)
    with TestClient(app, base_url=HOST):
        try:
            yield app
        finally:
            controls.obey_from_now_on()


def samples(app: FastAPI) -> dict[tuple[str, tuple[str, ...]], float]:
    """Every number, by name and labels' values."""
    answer = client_with(app, None).get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain")
    families = text_string_to_metric_families(answer.text)
    return {(s.name, tuple(s.labels.values())): s.value for family in families for s in family.samples}


def test_how_well_the_loops_kept_their_time(app: FastAPI, controls: HandControls) -> None:
    client = client_with(app, None)
    for number in (1, 2):
        wait_until(lambda: client.post(RUNS, json=MOTION).status_code == 202)
        control = controls.next(number)
        control.go(RunState.RUNNING, timing=TIMING)
        assert samples(app)["tauscope_runs_active", ("running",)] == 1.0
        control.finish()
        ended = "tauscope_runs_ended_total", ("sim", "finished")
        wait_until(lambda ended=ended, number=number: samples(app).get(ended) == number)
    found = samples(app)
    late = {labels: value for (name, labels), value in found.items() if name == "tauscope_loop_lateness_seconds_bucket"}
    assert late == {("sim", "1e-05"): 200.0, ("sim", "2e-05"): 218.0, ("sim", "+Inf"): 220.0}
    assert found["tauscope_missed_periods_total", ("sim",)] == 14.0
    assert found["tauscope_stale_samples_total", ("sim",)] == 10.0
    assert found["tauscope_runs_ended_total", ("sim", "finished")] == 2.0


def test_what_goes_on_is_told_while_it_does(app: FastAPI, controls: HandControls) -> None:
    client_with(app, None).post(RUNS, json=MOTION)
    control = controls.next()
    control.go(RunState.RUNNING)
    late = {"p50": 12.0, "p99": 80.0, "max": 2000.0}
    control._report({"event": "progress", "state": "running", "percent": 10.0, "lateness_us": late})
    found = samples(app)
    recent = {
        labels[0]: value for (name, labels), value in found.items() if name == "tauscope_loop_lateness_recent_seconds"
    }
    assert recent == pytest.approx({"p50": 12e-6, "p99": 80e-6, "max": 2e-3})


def test_jobs_are_timed_by_kind_and_outcome(settings: Settings) -> None:
    executor = ManualExecutor()
    app = create_app(settings, executor)
    with TestClient(app, base_url=HOST) as client:
        assert client.post("/api/v1/excitations", json={"robot": ROBOT}).status_code == 202
        assert client.post("/api/v1/excitations", json={"robot": ROBOT}).status_code == 202
        assert samples(app)["tauscope_jobs_waiting", ()] == 1.0
        executor.fail(RuntimeError("x"))
        found = samples(app)
        assert found["tauscope_job_seconds_count", ("excitation", "failed")] == 1.0
        assert found["tauscope_jobs_waiting", ()] == 0.0


def test_how_models_drift(tmp_path: Path) -> None:
    settings = Settings(data_folder=unpacked(SNAPSHOTS[-1], tmp_path))
    app = create_app(settings, InlineExecutor())
    with TestClient(app, base_url=HOST):
        services: Services = app.state.services
        (reference,) = (each for each in services.models.history.models("snapshot-arm", 10) if each.state == "active")
        viscous = services.models.history.document(reference.identifier).friction[0].viscous
        document = identified({"viscous": 1.5 * viscous}, friction__0__std__viscous=0.001)
        newer = candidate(364, document, robot="snapshot-arm", site=reference.site, source=reference.source)
        assert services.models.history.consider(newer, newer.created).state == "active"
        of_robot = ("snapshot-arm",)
        wait_until(lambda: samples(app).get(("tauscope_model_drift_events", of_robot)) == 1.0)
        found, of_parameter = samples(app), ("viscous shoulder", *of_robot)
        assert found["tauscope_model_drift_ratio", of_parameter] == pytest.approx(0.5)
        assert found["tauscope_model_drift_standard_errors", of_parameter] > 6.0


def test_requests_are_counted_by_the_pattern_of_their_route(app: FastAPI) -> None:
    client = client_with(app, None)
    for number in range(5):
        client.get(f"{RUNS}/{number}")
        client.get(f"/api/v1/nothing/{number}")
    found = samples(app)
    assert found["tauscope_requests_total", ("GET", "/api/v1/runs/{identifier}", "404")] == 5.0
    assert found["tauscope_requests_total", ("GET", "none", "404")] == 5.0
    assert not [labels for _, labels in found if "/3" in "".join(labels)]


def test_two_services_count_for_themselves(app: FastAPI, settings: Settings) -> None:
    other = create_app(settings.model_copy(update={"data_folder": settings.data_folder / "other"}), ManualExecutor())
    with TestClient(other, base_url=HOST) as client:
        client.get(RUNS)
        assert ("tauscope_requests_total", ("GET", RUNS, "200")) in samples(other)
    assert ("tauscope_requests_total", ("GET", RUNS, "200")) not in samples(app)
