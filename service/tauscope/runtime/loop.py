"""The cycle: wait, judge, write and read, log, report. What it needs was made before the arm was under power."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.journal_rows import Phase, journal_row_type
from tauscope.robot.robot import Array
from tauscope.runtime.guard import Guard, GuardViolationError
from tauscope.runtime.plan import Plan
from tauscope.runtime.record import RunRecord
from tauscope.runtime.recorder import Recorder
from tauscope.runtime.states import RunState, Stops, raise_if_requested
from tauscope.runtime.timing import Metronome
from tauscope.runtime.torque_control import TorqueControl
from tauscope_drivers import ArmState, Backend, ControlMode, Setpoint


class GuardedArm:
    """An arm that can only be commanded through its guard; nothing else calls `Backend.exchange`."""

    def __init__(self, backend: Backend, guard: Guard, state: ArmState) -> None:
        self._backend, self._guard = backend, guard
        self.state = state

    @property
    def stale(self) -> NDArray[np.int64]:
        """Readings that each joint did not answer, shape (n,)."""
        return self._guard.stale

    def exchange(self, setpoint: Setpoint, due_ns: int) -> ArmState:
        """Send a command due at `due_ns` [ns]. Raises GuardViolationError before it is sent, or DriverError."""
        violation = self._guard.check(self.state, setpoint, self._backend.clock.now_ns(), due_ns)
        if violation is not None:
            raise GuardViolationError(violation)
        self.state = self._backend.exchange(setpoint)
        return self.state


@dataclass
class Cycles:
    """What the loop does to each cycle, and what it keeps of all of them."""

    plan: Plan
    arm: GuardedArm
    metronome: Metronome
    recorder: Recorder
    stops: Stops
    control: TorqueControl | None  # closes the loop in torque mode; None where the drives do
    each_cycle: Callable[["Cycles"], None]
    latest_ns: int
    kept: int = field(init=False, default=0)  # samples of the motion, with an answer of every joint
    worst_following: Array = field(init=False)  # (n,), largest distance of arm and target so far [rad or m]
    late: NDArray[np.int64] = field(init=False)  # (n,) int64, readings whose instant is not known

    def __post_init__(self) -> None:
        n = self.plan.position.shape[1]
        self.worst_following = np.zeros(n)
        self.late = np.zeros(n, dtype=np.int64)
        self._row = np.zeros(1, dtype=journal_row_type(n))
        self._fields = {name: self._row[name] for name in self._row.dtype.names or ()}
        self._fields["time_ns"][0] = self.arm.state.time_ns - 1

    @property
    def played(self) -> float:
        """Part of the plan that was played, 0 to 1."""
        return (self.metronome.index + 1) / self.plan.cycles

    @property
    def kept_share(self) -> float:
        """Part of the motion's samples that was kept, 0 to 1."""
        planned = int(np.count_nonzero(np.asarray(self.plan.phase) == Phase.MOTION))
        return self.kept / planned if planned else 1.0

    @property
    def mode(self) -> ControlMode:
        return ControlMode.POSITION if self.control is None else ControlMode.TORQUE

    def play(self) -> None:
        """Raises StopAskedError, GuardViolationError or DriverError where it ends before the last cycle."""
        plan, metronome = self.plan, self.metronome
        while metronome.wait():
            raise_if_requested(self.stops)
            cycle = metronome.index
            torque = plan.torque[cycle] if self.control is None else self.control.torque(cycle, self.arm.state)
            state = self.arm.exchange(Setpoint(plan.position[cycle], torque), metronome.due_ns)
            self._log(cycle, state, torque)
            self.each_cycle(self)

    def _log(self, cycle: int, state: ArmState, torque: Array) -> None:
        """An answer that is missing, not newer, or too late to tell its instant is no sample: the guard counts it."""
        plan, row = self.plan, self._fields
        if state.late_ns > self.latest_ns:
            self.late += state.fresh
            return
        if state.time_ns <= row["time_ns"][0] or not state.fresh.any():
            return
        row["time_ns"][0], row["lateness_ns"][0] = state.time_ns, self.metronome.lateness_ns
        row["phase"][0], row["period"][0] = plan.phase[cycle], plan.period[cycle]
        row["position"][0], row["velocity"][0] = state.position, state.velocity
        row["effort"][0], row["temperature"][0] = state.effort, state.temperature
        row["voltage"][0] = np.nan if state.voltage is None else state.voltage
        row["reference"][0], row["reference_velocity"][0] = plan.position[cycle], plan.velocity[cycle]
        row["command"][0] = torque if self.control is not None else np.nan
        self.recorder.put(self._row)
        self.kept += bool(plan.phase[cycle] == Phase.MOTION and state.fresh.all())
        # A sample that was missed is NaN and counts for nothing.
        np.fmax(self.worst_following, np.abs(plan.position[cycle] - state.position), out=self.worst_following)


Report = Callable[[Mapping[str, Any]], None]
"""Takes an event: plain data with the key ``event``, one of ``state``, ``progress``, ``end``. Must be quick."""
INTERVAL_S = 0.2  # time between two words about progress


def state_event(state: RunState, at: datetime) -> dict[str, Any]:
    return {"event": "state", "state": state.value, "at": at.isoformat()}


def end_event(record: RunRecord) -> dict[str, Any]:
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
        now = time.monotonic()
        if now - self._last < INTERVAL_S:
            return
        recent = cycles.metronome.played - self._last_cycle
        self._last, self._last_cycle = now, cycles.metronome.played
        self._report(progress_event(cycles, state, recent))
