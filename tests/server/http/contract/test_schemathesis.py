"""Requests made from the OpenAPI document by Schemathesis, sensible and senseless: no 500, nothing undocumented.

Half of what is handed in is an example that works, so that the operations on what was made are reached too.
"""

import json
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import FlakyStrategyDefinition

from server.http.contract.documented import require_documented
from server.http.contract.running import running
from server.http.motions import ROBOT, move_document
from server.queue.controls import finish_at_once
from server.queue.executors import InlineExecutor
from tauscope.server.http import Settings, create_app

pytestmark = pytest.mark.slow

DOCUMENT = Path(__file__).parents[1] / "openapi.json"
PREFIX = "/api/v1"
WORKING: dict[str, dict[str, Any]] = {
    f"{PREFIX}/runs": {"robot": ROBOT, "trajectory": move_document()},
    f"{PREFIX}/excitations": {"robot": ROBOT},
    f"{PREFIX}/campaigns": {"robot": ROBOT},
    f"{PREFIX}/leases": {"robot": "another-arm", "ttl_s": 1.0},
    f"{PREFIX}/robots/check": {"robot": ROBOT},
}
SCENARIOS = 25
QUICK = settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
)


class SkippingExecutor(InlineExecutor):
    """Does nothing of what it is given: what is asked here is the interface, not the work."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        if "run_" in repr(fn):
            return super().submit(lambda *_, **__: None)
        return super().submit(fn, *args, **kwargs)


def make_app(folder: Path) -> FastAPI:
    settings = Settings(data_folder=folder, max_upload_bytes=2**20, max_document_bytes=2**18, max_waiting=5)
    return create_app(settings, SkippingExecutor(), finish_at_once)


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with running(make_app(tmp_path_factory.mktemp("service"))) as address:
        yield address


# Schemathesis is imported by the tests that need it: every test process collects this file.
def check(case: Any, answer: Any) -> None:
    """Hold an answer against the document."""
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi import checks

    wanted = [checks.status_code_conformance, checks.content_type_conformance, checks.response_schema_conformance]
    case.validate_response(answer, checks=[not_a_server_error, *wanted, checks.unsupported_method])
    require_documented(case.method, case.path, answer.status_code, answer.content)


def load(address: str) -> Any:
    import schemathesis

    return schemathesis.openapi.from_url(f"{address}/openapi.json")


def operation_names() -> list[str]:
    """Of the committed document; events last for as long as what they tell of, which may be long."""
    document = json.loads(DOCUMENT.read_bytes())
    return [f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods]


def make_work(case: Any, choice: bool) -> None:
    """Put an example that works in the place of what was drawn."""
    body = WORKING.get(case.path)
    if choice and case.method.upper() == "POST" and body is not None:
        case.body, case.media_type = body, "application/json"
        case.headers["content-type"] = "application/json"


@pytest.mark.parametrize("name", operation_names())
def test_every_operation_answers_as_documented(name: str, address: str) -> None:
    method, path = name.split(" ")
    operation = load(address)[path][method]
    seen: list[int] = []

    @QUICK
    @given(case=operation.as_strategy(), works=st.booleans())
    def ask(case: Any, works: bool) -> None:
        make_work(case, works)
        answer = case.call(base_url=address, timeout=30)
        seen.append(answer.status_code)
        check(case, answer)

    ask()
    assert seen


def test_what_was_made_is_used_removed_and_used_again(address: str) -> None:
    machine = load(address).as_state_machine()
    statuses: list[tuple[str, int]] = []
    wrong: list[Exception] = []

    class Machine(machine):
        def before_call(self, case: Any) -> None:
            make_work(case, zlib.crc32(repr(case.body).encode()) % 4 != 0)

        def get_call_kwargs(self, case: Any) -> dict[str, Any]:
            return {"base_url": address, "timeout": 30}

        def after_call(self, response: Any, case: Any) -> None:
            statuses.append((f"{case.method} {case.path}", response.status_code))

        def validate_response(self, response: Any, case: Any, **kwargs: Any) -> None:
            try:
                check(case, response)
            except Exception as error:
                wrong.append(error)
                raise

    one = settings(
        max_examples=1,
        stateful_step_count=15,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
    )
    # One example a run: the service remembers, so that no example can be played twice to the same end. Hypothesis plays
    # on where it rejects the first, and calls what differs then inconsistent; a wrong answer is kept whatever it says.
    # What a sequence reaches depends on how fast the service's own work ends: a busy machine needs more of them.
    reached: set[str] = set()
    for number in range(4 * SCENARIOS):
        if number >= SCENARIOS and len(reached) >= 5:
            break
        with suppress(FlakyStrategyDefinition):
            seed(number)(Machine).run(settings=one)
        if wrong:
            raise wrong[0]
        reached = {operation for operation, status in statuses if "{identifier}" in operation and status < 300}
    assert len(reached) >= 5, "hardly anything that was made was reached"
