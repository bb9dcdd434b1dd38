"""The states of a job: every pair of them."""

from datetime import UTC, datetime
from itertools import product

import pytest

from tauscope.server.queue.job_folder import TRANSITIONS, JobProblem, JobRecord, JobState, may_follow

Q, R, S, F, C, I = JobState  # noqa: E741
ALLOWED = {(Q, R), (Q, C), (Q, I), (R, S), (R, F), (R, C), (R, I), (R, Q)}
NOON = datetime(2026, 11, 3, 12, tzinfo=UTC)


@pytest.mark.parametrize(("before", "after"), list(product(JobState, JobState)))
def test_every_pair(before: JobState, after: JobState) -> None:
    assert may_follow(before, after) == ((before, after) in ALLOWED)
    record = JobRecord(state=before, created=NOON)
    if (before, after) in ALLOWED:
        assert record.moved(after, NOON).state is after
    else:
        with pytest.raises(ValueError, match=f"{before} cannot become {after}"):
            record.moved(after, NOON)


def test_the_table_holds_every_state() -> None:
    assert set(TRANSITIONS) == set(JobState)
    assert {state for state in JobState if state.is_end} == {S, F, C, I}


@pytest.mark.parametrize("state", list(JobState))
def test_a_job_can_be_stopped_in_every_state_that_is_no_end(state: JobState) -> None:
    assert state.is_end or (may_follow(state, C) and may_follow(state, I))


def test_times_and_problem_of_a_record() -> None:
    record = JobRecord(state=Q, created=NOON).moved(R, NOON.replace(hour=13))
    problem = JobProblem(code="recording", detail="a.csv: row 3")
    ended = record.moved(F, NOON.replace(hour=14), problem)
    assert (ended.created, ended.started, ended.ended) == tuple(NOON.replace(hour=h) for h in (12, 13, 14))
    assert ended.problem == problem
    assert JobRecord.model_validate_json(ended.model_dump_json()) == ended
