"""The examples on the pages of problems that only the service meets are what it answers: each is provoked over HTTP."""

import json
import os
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from httpx2 import Response
from starlette.testclient import TestClient

from server.auth.keyed import client_with
from server.conftest import RECORDINGS, connected, make_data_folder
from server.http.motions import ROBOT, move_document
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls
from server.queue.executors import ManualExecutor
from shared_data import REPOSITORY
from tauscope.server.auth.gate import RateLimit
from tauscope.server.auth.keys import KeyFile, Scope
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services
from tauscope.server.problems import KINDS
from tauscope.server.queue.queue import MOST_ATTEMPTS

RUNS, LEASES, IDENTIFICATIONS = (f"/api/v1/{name}" for name in ("runs", "leases", "identifications"))
ARM = {"robot": "two-joint-arm", "backend": "sim"}
MOTION = {"robot": ROBOT, "trajectory": move_document()}
CSV = b"t,q1,q2,tau1,tau2\n" + b"".join(b"%d,0,0,0,0\n" % k for k in range(20))
ONCE = {"Idempotency-Key": "5d2f8c1a"}
IDENTIFIER = re.compile(r"[0-9]{8}T[0-9]{6}Z-[0-9a-f]{8}")
EXAMPLE_ID = "20261103T101502Z-1f2e3d4c"
"""Stands on the pages wherever an identifier does."""


class Workers(ManualExecutor):
    """Does everything at once, until a test wants it to wait."""

    waits = False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future = super().submit(fn, *args, **kwargs)
        if not self.waits:
            self.run(-1)
        return future


@dataclass
class Bench:
    """A service whose work and whose arm the test moves by hand."""

    settings: Settings
    executor: Workers = field(default_factory=Workers)
    controls: HandControls = field(default_factory=HandControls)
    app: FastAPI = field(init=False)
    patch: pytest.MonkeyPatch = field(default_factory=pytest.MonkeyPatch)

    def __post_init__(self) -> None:
        self.app = create_app(self.settings, self.executor, self.controls)

    @property
    def services(self) -> Services:
        return self.app.state.services

    def client(self, scope: Scope | None = None, name: str = "", life: timedelta | None = None) -> TestClient:
        """A client without a key, or with a new one."""
        if scope is None:
            return client_with(self.app, None)
        made = datetime.now(UTC) - timedelta(days=100)
        key = KeyFile(self.settings.data_folder).add(name or scope.value, scope, made, life)[1]
        self.services.access.ring.look()
        return client_with(self.app, key)

    def identify(self) -> dict[str, Any]:
        """An identification whose work has begun and goes on."""
        self.client().post(RECORDINGS, files={"file": ("a.csv", CSV)})
        self.executor.waits = True
        answer = self.client().post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": ["a.csv"]})
        assert answer.status_code == 202, answer.text
        return answer.json()

    def result(self, job: dict[str, Any]) -> Response:
        return self.client().get(f"{job['links']['self']}/result")


@pytest.fixture
def bench(tmp_path: Path, new_database: Path) -> Iterator[Bench]:
    data = make_data_folder(tmp_path / "data", new_database)
    bench = Bench(Settings(data_folder=data, max_upload_bytes=2**20, max_waiting=2))
    with connected(bench.app):
        try:
            yield bench
        finally:
            bench.patch.undo()
            bench.controls.obey_from_now_on()


def a_wrong_field(bench: Bench) -> Response:
    return bench.client().post(
        IDENTIFICATIONS, json={"robot": ROBOT, "recordings": ["a.csv"], "options": {"cutoff": 5}}
    )


def no_recording(bench: Bench) -> Response:
    return bench.client().post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": []})


def an_unknown_part(bench: Bench) -> Response:
    return bench.client().post(RECORDINGS, files={"recording": ("a.csv", CSV)})


def a_form_cut_off(bench: Bench) -> Response:
    head = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.csv"\r\n\r\nt,q1'
    return bench.client().post(RECORDINGS, content=head, headers={"content-type": "multipart/form-data; boundary=b"})


def a_method_that_is_none(bench: Bench) -> Response:
    return bench.client().put(RUNS)


def a_plain_body(bench: Bench) -> Response:
    return bench.client().post(RUNS, content=b"robot: arm", headers={"content-type": "application/yaml"})


def another_host(bench: Bench) -> Response:
    return bench.client().get(RUNS, headers={"host": "arm3.example"})


def another_origin(bench: Bench) -> Response:
    return bench.client().get(RUNS, headers={"origin": "http://intranet.example"})


def no_key(bench: Bench) -> Response:
    bench.client(Scope.READ)
    return bench.client().get(RUNS)


def a_wrong_key(bench: Bench) -> Response:
    bench.client(Scope.READ)
    return client_with(bench.app, "tsk_00000000_x").get(RUNS)


def an_expired_key(bench: Bench) -> Response:
    return bench.client(Scope.READ, "line 3", timedelta(days=90)).get(RUNS)


def a_key_that_only_reads(bench: Bench) -> Response:
    return bench.client(Scope.READ, "line 3").post(RUNS, json=MOTION)


def a_take_without_leave(bench: Bench) -> Response:
    return bench.client(Scope.MOVE, "line 3").post(LEASES, json={**ARM, "take": True})


def too_many_requests(bench: Bench) -> Response:
    client = bench.client(Scope.READ)
    object.__setattr__(bench.services.access, "rate", RateLimit(0.5, 1.0, clock=lambda: 0.0))
    client.get(RUNS)
    return client.get(RUNS)


def a_name_in_use(bench: Bench) -> Response:
    bench.client().post(RECORDINGS, files={"file": ("monday.csv", CSV)})
    return bench.client().post(RECORDINGS, files={"file": ("monday.csv", CSV + b"20,0,0,0,0\n")})


def an_arm_that_moves(bench: Bench) -> Response:
    bench.client().post(RUNS, json=MOTION)
    bench.controls.next()
    return bench.client().post(RUNS, json=MOTION)


def an_arm_of_somebody_else(bench: Bench) -> Response:
    bench.client().post(LEASES, json={**ARM, "holder": "Ann", "ttl_s": 30.0})
    return bench.client().post(RUNS, json=MOTION)


def no_lease(bench: Bench) -> Response:
    return bench.client(Scope.MOVE).post(RUNS, json=MOTION)


def a_lease_that_ended(bench: Bench) -> Response:
    lease = bench.client().post(LEASES, json=ARM).json()
    bench.client().delete(lease["links"]["self"], headers={"Lease-Token": lease["token"]})
    return bench.client().post(RUNS, json=MOTION, headers={"Lease-Token": lease["token"]})


def a_heartbeat_too_late(bench: Bench) -> Response:
    lease = bench.client().post(LEASES, json=ARM).json()
    bench.client().delete(lease["links"]["self"], headers={"Lease-Token": lease["token"]})
    return bench.client().post(lease["links"]["heartbeat"], headers={"Lease-Token": lease["token"]})


def a_lease_not_armed(bench: Bench) -> Response:
    lease = bench.client().post(LEASES, json={**ARM, "ttl_s": 30.0}).json()
    return bench.client().post(RUNS, json=MOTION, headers={"Lease-Token": lease["token"]})


def an_unknown_fate(bench: Bench) -> Response:
    bench.client().post(RECORDINGS, files={"file": ("a.csv", CSV)}, headers=ONCE)
    (kept,) = (bench.settings.data_folder / "idempotency").iterdir()
    kept.write_bytes(b"")  # as a service leaves it that is killed before it has answered
    return bench.client().post(RECORDINGS, files={"file": ("a.csv", CSV)}, headers=ONCE)


def a_key_used_twice(bench: Bench) -> Response:
    bench.client().post(RECORDINGS, files={"file": ("a.csv", CSV)}, headers=ONCE)
    return bench.client().post(RECORDINGS, files={"file": ("b.csv", CSV)}, headers=ONCE)


def a_result_too_early(bench: Bench) -> Response:
    return bench.result(bench.identify())


def a_run_that_goes_on(bench: Bench) -> Response:
    run = bench.client().post(RUNS, json=MOTION).json()
    bench.controls.next()
    return bench.client().delete(run["links"]["self"])


def a_job_that_was_cancelled(bench: Bench) -> Response:
    job = bench.identify()
    bench.client().delete(job["links"]["self"])
    return bench.result(job)


def a_job_that_kills_the_service(bench: Bench) -> Response:
    settings = bench.settings.model_copy(update={"data_folder": bench.settings.data_folder / "another"})
    first, second = Bench(settings), Bench(settings)
    with connected(first.app):
        job = first.identify()
    state = settings.data_folder / "identifications" / job["id"] / "state.json"
    record = json.loads(state.read_text(encoding="utf-8"))
    state.write_text(json.dumps({**record, "attempts": MOST_ATTEMPTS}), encoding="utf-8")
    with connected(second.app):
        return second.result(job)


def a_file_that_was_changed(bench: Bench) -> Response:
    job = bench.identify()
    (bench.settings.data_folder / "identifications" / job["id"] / "state.json").write_bytes(b"\0")
    return bench.result(job)


def a_model_in_use(bench: Bench) -> Response:
    job = bench.identify()
    bench.executor.run()
    bench.patch.setattr(bench.services.models.history, "list_protected", lambda: frozenset({job["id"]}))
    return bench.client().delete(job["links"]["self"])


def entries_that_were_lost(bench: Bench) -> Response:
    bench.services.audit.lost = 2
    return bench.client().get("/readyz")


def a_service_that_ends(bench: Bench) -> Response:
    bench.services.closing.set()
    return bench.client().get("/readyz")


def a_full_queue(bench: Bench) -> Response:
    for _ in range(1 + bench.settings.max_waiting):
        bench.identify()
    return bench.client().post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": ["a.csv"]})


def a_full_disk(bench: Bench) -> Response:
    def full(_: int) -> None:
        raise OSError(28, os.strerror(28))

    bench.patch.setattr("os.fsync", full)
    return bench.client().post(RECORDINGS, files={"file": ("a.csv", CSV)})


def a_full_disk_before_a_motion(bench: Bench) -> Response:
    def full(_: int) -> None:
        raise OSError(28, os.strerror(28))

    bench.patch.setattr("os.fsync", full)
    return bench.client().post(RUNS, json=MOTION)


def a_worker_that_dies(bench: Bench) -> Response:
    job = bench.identify()
    for _ in range(MOST_ATTEMPTS):
        bench.executor.fail(BrokenProcessPool("killed"))
    return bench.result(job)


def a_fault_in_a_request(bench: Bench) -> Response:
    def fail(*_: object) -> None:
        raise KeyError("x")

    bench.patch.setattr("tauscope.server.store.data_folder.ItemStore.identifiers", fail)
    return bench.client().get(RUNS)


def a_fault_in_a_job(bench: Bench) -> Response:
    job = bench.identify()
    bench.executor.fail(KeyError("x"))
    return bench.result(job)


PROVOKED: list[tuple[str, Callable[[Bench], Response]]] = [
    ("invalid-request", a_wrong_field),
    ("invalid-request", no_recording),
    ("invalid-request", an_unknown_part),
    ("bad-request", a_form_cut_off),
    ("method-not-allowed", a_method_that_is_none),
    ("media-type", a_plain_body),
    ("host", another_host),
    ("origin", another_origin),
    ("unauthorized", no_key),
    ("unauthorized", a_wrong_key),
    ("unauthorized", an_expired_key),
    ("forbidden", a_key_that_only_reads),
    ("forbidden", a_take_without_leave),
    ("rate-limited", too_many_requests),
    ("name-taken", a_name_in_use),
    ("busy", an_arm_that_moves),
    ("leased", an_arm_of_somebody_else),
    ("lease-needed", no_lease),
    ("lease-lost", a_lease_that_ended),
    ("lease-lost", a_heartbeat_too_late),
    ("not-armed", a_lease_not_armed),
    ("not-repeatable", an_unknown_fate),
    ("key-reused", a_key_used_twice),
    ("not-finished", a_result_too_early),
    ("not-finished", a_run_that_goes_on),
    ("cancelled", a_job_that_was_cancelled),
    ("interrupted", a_job_that_kills_the_service),
    ("damaged", a_file_that_was_changed),
    ("in-use", a_model_in_use),
    ("not-ready", entries_that_were_lost),
    ("not-ready", a_service_that_ends),
    ("queue-full", a_full_queue),
    ("storage-full", a_full_disk),
    ("storage-full", a_full_disk_before_a_motion),
    ("worker-lost", a_worker_that_dies),
    ("internal", a_fault_in_a_request),
    ("internal", a_fault_in_a_job),
]


@pytest.mark.parametrize(("code", "provoke"), PROVOKED, ids=[provoke.__name__ for _, provoke in PROVOKED])
def test_the_page_shows_what_the_service_answers(
    code: str, provoke: Callable[[Bench], Response], bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("CRITICAL")  # the faults are made on purpose
    problem = assert_problem(provoke(bench), code, int(KINDS[code].status))
    said = IDENTIFIER.sub(EXAMPLE_ID, problem["detail"])
    said = re.sub(r"for \d+\.\d s more", "for 25.0 s more", said)
    page = (REPOSITORY / "docs" / "errors" / f"{code}.md").read_text(encoding="utf-8")
    assert f"\n{said}\n" in page, f"docs/errors/{code}.md does not show:\n{said}"
