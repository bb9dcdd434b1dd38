"""The states of a run, the transitions between them, and the requests that stop it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol


class RunState(StrEnum):
    """Where a run stands; the last five are ends. One that is `degraded` was played and lost many samples."""

    CREATED = "created"
    CONNECTING = "connecting"
    ENABLING = "enabling"
    RAMPING = "ramping"
    RUNNING = "running"
    STOPPING = "stopping"
    FINISHED = "finished"
    DEGRADED = "degraded"
    STOPPED = "stopped"
    FAILED = "failed"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        return not TRANSITIONS[self]


_ENDS = frozenset([*RunState][-5:])
_LEFT_BEHIND = frozenset({RunState.STOPPING, RunState.INTERRUPTED})

TRANSITIONS: Mapping[RunState, frozenset[RunState]] = {
    RunState.CREATED: frozenset({RunState.CONNECTING}) | _LEFT_BEHIND,
    RunState.CONNECTING: frozenset({RunState.ENABLING}) | _LEFT_BEHIND,
    RunState.ENABLING: frozenset({RunState.RAMPING}) | _LEFT_BEHIND,
    RunState.RAMPING: frozenset({RunState.RUNNING}) | _LEFT_BEHIND,
    RunState.RUNNING: _LEFT_BEHIND,
    RunState.STOPPING: _ENDS,
    **dict.fromkeys(_ENDS, frozenset()),
}
"""For each state, the states that may follow. No run ends without having been stopped, but for one whose process is
gone: that is `interrupted`, and the device's watchdog has stopped the arm."""


def may_follow(before: RunState, after: RunState) -> bool:
    return after in TRANSITIONS[before]


class StopSource(StrEnum):
    OPERATOR = "operator"  # a byte on the pipe, the stop file, or a signal
    OWNER_GONE = "owner-gone"  # the process that started the run has died, or is silent while the arm runs in real time


@dataclass(frozen=True)
class StopRequest:
    source: StopSource
    detail: str

    @property
    def end(self) -> RunState:
        return RunState.STOPPED if self.source is StopSource.OPERATOR else RunState.INTERRUPTED


class StopAskedError(Exception):
    """Breaks a run out of whatever it is doing because it was asked to stop."""

    def __init__(self, request: StopRequest) -> None:
        super().__init__(request.detail)
        self.request = request


class Stops(Protocol):
    @property
    def requested(self) -> StopRequest | None:
        """The first request, None where there is none."""

    def enter_real_time(self) -> None:
        """The arm moves by the wall clock: apply the limits of real time from here on."""

    def acknowledge(self) -> None: ...

    def done(self) -> None:
        """The arm is stopped, or nothing more can be done for it: nobody breaks into the run any more."""


class ManualStop:
    """A request by a call, from any thread."""

    def __init__(self) -> None:
        self.requested: StopRequest | None = None
        self.acknowledged = False

    def request(self, detail: str = "asked to stop", source: StopSource = StopSource.OPERATOR) -> None:
        if self.requested is None:
            self.requested = StopRequest(source, detail)

    def enter_real_time(self) -> None: ...

    def acknowledge(self) -> None:
        self.acknowledged = True

    def done(self) -> None: ...


def raise_if_requested(stops: Stops) -> None:
    """Break out of a run that was asked to stop. Raises StopAskedError where there is one."""
    if stops.requested is not None:
        stops.acknowledge()
        raise StopAskedError(stops.requested)
