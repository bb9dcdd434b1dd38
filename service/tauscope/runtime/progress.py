"""What a run tells its owner while it runs: plain data, small and often."""

import time
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.runtime.loop import Cycles
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState

Report = Callable[[Mapping[str, Any]], None]
"""Takes an event: plain data with the key ``event``, one of ``state``, ``progress``, ``end``. Must be quick."""

INTERVAL_S = 0.2
"""Time between two words about progress."""


def state_event(state: RunState, at: datetime) -> dict[str, Any]:
    """The event of a transition."""
    return {"event": "state", "state": state.value, "at": at.isoformat()}


def end_event(record: RunRecord) -> dict[str, Any]:
    """The last event of a run."""
    problem = None if record.problem is None else record.problem.detail
    samples = 0 if record.recording is None else record.recording.samples
    return {"event": "end", "state": record.state.value, "problem": problem, "stop": record.stop, "samples": samples}


def progress_event(cycles: Cycles, state: RunState, recent: int) -> dict[str, Any]:
    """How far a run is, and how near to its limits it has come."""
    plan, limits = cycles.plan, cycles.plan.limits
    target = plan.position[cycles.metronome.index]
    room = np.minimum(target - limits.position_low, limits.position_high - target)
    return {
        "event": "progress",
        "state": state.value,
        "percent": round(100.0 * cycles.played, 2),
        "time_s": round((cycles.metronome.index + 1) / plan.rate_hz, 3),
        "duration_s": round(plan.cycles / plan.rate_hz, 3),
        "target": [round(float(value), 5) for value in target],
        "position": _null_unmeasured(cycles.arm.state.position),
        "effort": _null_unmeasured(cycles.arm.state.effort),
        "position_range": [_null_unmeasured(limits.position_low), _null_unmeasured(limits.position_high)],
        "torque_limit": _null_unmeasured(limits.torque),
        "following_error": [float(value) for value in cycles.worst_following],
        "following_share": round(float((cycles.worst_following / limits.following).max()), 4),
        "position_room": [float(value) for value in room],
        "lateness_us": dict(cycles.metronome.recent_lateness_us(recent)),
        "missed_periods": cycles.metronome.missed,
        "stale_samples": [int(count) for count in cycles.arm.stale],
        "lost_rows": cycles.recorder.lost,
    }


def _null_unmeasured(values: NDArray[np.float64]) -> list[float | None]:
    """Numbers as plain data: what was not measured, or has no limit, is None."""
    return [round(float(value), 5) if np.isfinite(value) else None for value in values]


class ProgressReporter:
    """Reports at most every `INTERVAL_S` of the machine's time, whatever clock the run keeps."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._last = time.monotonic()
        self._last_cycle = 0

    def __call__(self, cycles: Cycles, state: RunState) -> None:
        """Report where it is time to."""
        now = time.monotonic()
        if now - self._last < INTERVAL_S:
            return
        recent = cycles.metronome.played - self._last_cycle
        self._last, self._last_cycle = now, cycles.metronome.played
        self._report(progress_event(cycles, state, recent))
