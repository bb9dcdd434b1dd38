"""The states of a run, and the ways from one to another."""

from collections.abc import Mapping
from enum import StrEnum


class RunState(StrEnum):
    """Where a run stands; the last four are ends."""

    CREATED = "created"
    CONNECTING = "connecting"
    ENABLING = "enabling"
    RAMPING = "ramping"
    RUNNING = "running"
    STOPPING = "stopping"
    FINISHED = "finished"
    STOPPED = "stopped"
    FAILED = "failed"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        """Whether nothing will happen to the run any more."""
        return not TRANSITIONS[self]


_LEFT_BEHIND = frozenset({RunState.STOPPING, RunState.INTERRUPTED})

TRANSITIONS: Mapping[RunState, frozenset[RunState]] = {
    RunState.CREATED: frozenset({RunState.CONNECTING}) | _LEFT_BEHIND,
    RunState.CONNECTING: frozenset({RunState.ENABLING}) | _LEFT_BEHIND,
    RunState.ENABLING: frozenset({RunState.RAMPING}) | _LEFT_BEHIND,
    RunState.RAMPING: frozenset({RunState.RUNNING}) | _LEFT_BEHIND,
    RunState.RUNNING: _LEFT_BEHIND,
    RunState.STOPPING: frozenset({RunState.FINISHED, RunState.STOPPED, RunState.FAILED, RunState.INTERRUPTED}),
    RunState.FINISHED: frozenset(),
    RunState.STOPPED: frozenset(),
    RunState.FAILED: frozenset(),
    RunState.INTERRUPTED: frozenset(),
}
"""For each state, the states that may follow. No run ends without having been stopped, but for one whose process is
gone: that is `interrupted`, and the device's watchdog has stopped the arm."""


def may_follow(before: RunState, after: RunState) -> bool:
    """Whether a run may go from one state to another."""
    return after in TRANSITIONS[before]


def after_stop(state: RunState) -> RunState:
    """Where a request to stop leads: legal in every state, and without effect on a run that stops or has ended."""
    return state if state is RunState.STOPPING or state.is_end else RunState.STOPPING
