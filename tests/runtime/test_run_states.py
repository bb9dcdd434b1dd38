"""The states of a run: every pair of them."""

from datetime import UTC, datetime
from itertools import pairwise, product

import pytest

from tauscope.runtime.record import new_record
from tauscope.runtime.states import TRANSITIONS, RunState, may_follow

NOON = datetime(2026, 11, 3, 12, tzinfo=UTC)
WAY = [RunState.CREATED, RunState.CONNECTING, RunState.ENABLING, RunState.RAMPING, RunState.RUNNING]
ENDS = [RunState.FINISHED, RunState.DEGRADED, RunState.STOPPED, RunState.FAILED, RunState.INTERRUPTED]
ALLOWED = {
    *pairwise(WAY),
    *((state, RunState.STOPPING) for state in WAY),
    *((state, RunState.INTERRUPTED) for state in WAY),
    *((RunState.STOPPING, end) for end in ENDS),
}


@pytest.mark.parametrize(("before", "after"), list(product(RunState, RunState)))
def test_every_pair(before: RunState, after: RunState) -> None:
    assert may_follow(before, after) == ((before, after) in ALLOWED)
    record = new_record("arm", "sim", "position", NOON).model_copy(update={"state": before})
    if (before, after) in ALLOWED:
        moved = record.moved(after, NOON.replace(hour=13))
        assert moved.state is after
        assert (moved.history[-1].state, moved.history[-1].at) == (after, NOON.replace(hour=13))
    else:
        with pytest.raises(ValueError, match=f"{before} cannot become {after}"):
            record.moved(after, NOON)


def test_the_table_holds_every_state_and_its_ends() -> None:
    assert set(TRANSITIONS) == set(RunState)
    assert [state for state in RunState if state.is_end] == ENDS


@pytest.mark.parametrize("state", list(RunState))
def test_a_stop_is_legal_in_every_state(state: RunState) -> None:
    assert state is RunState.STOPPING or state.is_end or may_follow(state, RunState.STOPPING)


def test_a_record_survives_its_file_form() -> None:
    record = new_record("arm", "sim", "position", NOON).moved(RunState.STOPPING, NOON, stop="asked")
    assert type(record).model_validate_json(record.model_dump_json()) == record
