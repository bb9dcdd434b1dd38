"""What every problem has to be (RFC 9457)."""

from typing import Any

from httpx2 import Response


def assert_problem(answer: Response, code: str, status: int) -> dict[str, Any]:
    """The problem of an answer, which is complete, one line, and without internals."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    problem = answer.json()
    assert (problem["code"], problem["status"], answer.status_code) == (code, status, status), problem
    assert problem["type"] == f"/docs/errors/{code}"
    assert problem["title"]
    assert problem["instance"].startswith("/")
    assert problem["detail"]
    assert "\n" not in problem["detail"]
    assert "Traceback" not in problem["detail"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    return problem
