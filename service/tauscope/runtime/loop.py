"""The cycle: wait, judge, write and read, log. Everything that it needs was made before the arm was under power."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.journal_rows import Phase, journal_row_type
from tauscope.runtime.guard import Guard, GuardViolationError
from tauscope.runtime.plan import Plan
from tauscope.runtime.recorder import Recorder
from tauscope.runtime.states import Stops, raise_if_requested
from tauscope.runtime.timing import Metronome
from tauscope.runtime.torque_control import TorqueControl
from tauscope_drivers import ArmState, Backend, ControlMode, Setpoint

Array = NDArray[np.float64]


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
        """Send a command that the guard passes, and read the arm.

        Raises GuardViolationError where the guard objects; nothing was sent. Raises DriverError where the backend
        cannot.

        `due_ns`: when it was to be sent [ns].
        """
        violation = self._guard.check(self.state, setpoint, self._backend.clock.now_ns(), due_ns)
        if violation is not None:
            raise GuardViolationError(violation)
        self.state = self._backend.exchange(setpoint)
        return self.state


@dataclass
class Cycles:
    """What the loop does to each cycle, and what it keeps of all of them.

    `control`: closes the loop in torque mode; None where the drives do.
    `worst_following`: (n,), largest distance of arm and target so far [rad or m].
    `late`: (n,) int64, readings whose instant is not known.
    `kept`: samples of the motion, with an answer of every joint.
    """

    plan: Plan
    arm: GuardedArm
    metronome: Metronome
    recorder: Recorder
    stops: Stops
    control: TorqueControl | None
    each_cycle: Callable[["Cycles"], None]
    latest_ns: int
    kept: int = field(init=False, default=0)
    worst_following: Array = field(init=False)
    late: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        """Make the one row that all cycles are written into."""
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
        """Who closes the loop."""
        return ControlMode.POSITION if self.control is None else ControlMode.TORQUE

    def play(self) -> None:
        """Play the plan from its first cycle to its last.

        Raises StopAskedError where it was asked to stop. Raises GuardViolationError where the guard objected. Raises
        DriverError where the backend gave up.
        """
        plan, metronome = self.plan, self.metronome
        while metronome.wait():
            raise_if_requested(self.stops)
            cycle = metronome.index
            torque = plan.torque[cycle] if self.control is None else self.control.torque(cycle, self.arm.state)
            state = self.arm.exchange(Setpoint(plan.position[cycle], torque), metronome.due_ns)
            self._log(cycle, state, torque)
            self.each_cycle(self)

    def _log(self, cycle: int, state: ArmState, torque: Array) -> None:
        """No answer at all, or one that is no newer than the one before, is no sample: the guard counts it.

        Nor is one that came so late that nobody knows of which instant it tells.
        """
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
