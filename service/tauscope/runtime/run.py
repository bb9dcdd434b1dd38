"""One run from its beginning to its end. It fails closed: whatever happens, the arm is stopped and the state told."""

import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tauscope.errors import AcquisitionError, TauscopeError, one_line
from tauscope.recording.journal_rows import JournalHeader, Phase
from tauscope.robot import Robot
from tauscope.runtime.drivers import DEFAULT_BACKEND, Connection, make_backend, translate_driver_errors
from tauscope.runtime.guard import Guard, GuardViolationError
from tauscope.runtime.loop import Cycles, GuardedArm, ProgressReporter, Report, end_event, state_event
from tauscope.runtime.options import ORDER_FILE, RELEASE, RunOptions, choose_stop_policy, is_released
from tauscope.runtime.plan import Plan, make_plan
from tauscope.runtime.record import JOURNAL_FILE, RUN_FILE, RunProblem, RunRecord, Transition, keep_record, new_record
from tauscope.runtime.recorder import DirectRecorder, Recorder, RecorderProcess, save_recording
from tauscope.runtime.states import ManualStop, RunState, StopAskedError, Stops, raise_if_requested
from tauscope.runtime.timing import SIMULATED_TIME, Metronome, real_time
from tauscope.runtime.torque_control import torque_control
from tauscope.trajectory import Trajectory
from tauscope_drivers import ArmState, Backend, ControlMode, DriverError, StopPolicy

OpenRecorder = Callable[[Path, JournalHeader, Stops, bool], Recorder]
"""Opens a journal: its path, its header, requests to stop, and whether the arm runs in real time."""


@dataclass(frozen=True, eq=False)
class RunTask:
    robot: Robot
    trajectory: Trajectory
    options: RunOptions
    connect: Callable[[], Connection]


@dataclass(frozen=True)
class Surroundings:
    folder: Path
    stops: Stops
    keep: Callable[[RunRecord], object]  # the newest record, whenever it changes; must not take time
    open_recorder: OpenRecorder
    report: Report


LEAST_CYCLES_A_WATCHDOG = 2  # A watchdog has to outlast this many cycles, or every late one stops the arm


def prepare(task: RunTask, backend: Backend, state: ArmState) -> Plan:
    """Plan a run without torque. Raises AcquisitionError where backend, drives or motion do not allow it."""
    options, capabilities = task.options, backend.capabilities
    choose_stop_policy(options, task.robot.joints, capabilities)
    if options.mode not in capabilities.modes:
        can = ", ".join(sorted(capabilities.modes))
        raise AcquisitionError(f"mode {options.mode}: this arm's drives cannot do that; choose {can}")
    shortest, longest = capabilities.watchdog_range_s
    if not shortest <= options.watchdog_s <= longest:
        raise AcquisitionError(
            f"a watchdog of {options.watchdog_s:g} s: this arm's drives take {shortest:g} to {longest:g} s"
        )
    state = _sound(backend, state, options)
    plan = make_plan(task.robot, task.trajectory, state.position, options, capabilities, state.voltage)
    least = LEAST_CYCLES_A_WATCHDOG * plan.period_ns * 1e-9
    if options.watchdog_s < least:
        raise AcquisitionError(
            f"a watchdog of {options.watchdog_s:g} s is too short for {plan.rate_hz:g} cycles a second; "
            f"take {least:.3g} s or more"
        )
    return plan


def journal_header(robot: Robot, plan: Plan, backend: Backend, state: ArmState, mode: str) -> JournalHeader:
    unit = backend.capabilities.effort_unit
    return JournalHeader(
        robot=robot.name,
        joint_names=tuple(joint.name for joint in robot.joints),
        rate_hz=plan.rate_hz,
        mode=mode,
        effort_unit=unit,
        torque_per_effort=tuple(1.0 if unit == "Nm" else joint.torque_constant for joint in robot.joints),
        has_velocity=bool(np.isfinite(state.velocity).any()),
        epoch_offset_ns=time.time_ns() - backend.clock.now_ns(),
    )


def _sound(backend: Backend, state: ArmState, options: RunOptions) -> ArmState:
    """The state without faults, where the operator has said that they may be cleared."""
    if state.faults and options.acknowledge_faults:
        state = backend.acknowledge_faults()
    if state.faults:
        raise AcquisitionError(f"{state.faults[0]}; then acknowledge the fault")
    return state


INTERNAL = "internal"  # code of a problem that is a fault of Tauscope's own


class Run:
    def __init__(self, task: RunTask, record: RunRecord, around: Surroundings) -> None:
        """Prepare; nothing happens before `execute`."""
        self.record = record
        self._task, self._around = task, around
        self._policy = choose_stop_policy(task.options, task.robot.joints)
        self._backend: Backend | None = None
        self._recorder: Recorder | None = None
        self._cycles: Cycles | None = None
        self._is_released = is_released(task.options, task.robot.joints)
        self._is_played = False
        self._is_stopped = False
        self._unconfirmed: str | None = None
        self._holds: bool | None = None
        self._progress = ProgressReporter(self._tell)

    def execute(self) -> RunRecord:
        cause: BaseException | None = None
        try:
            self._move()
        except BaseException as error:
            # Whatever it is, the arm has to stop and the state be told.
            cause = error
        self._stop_arm()
        end, changes = _outcome(cause)
        self._enter(RunState.STOPPING, **changes, **self._account())
        return self._conclude(end)

    def _move(self) -> None:
        raise_if_requested(self._around.stops)
        self._enter(RunState.CONNECTING)
        connection = self._task.connect()
        if connection.is_real_time:
            self._around.stops.enter_real_time()
        self._backend = backend = connection.backend
        state = backend.connect()
        raise_if_requested(self._around.stops)
        plan = prepare(self._task, backend, state)
        header = journal_header(self._task.robot, plan, backend, state, self._task.options.mode.value)
        journal, stops = self._around.folder / JOURNAL_FILE, self._around.stops
        self._recorder = recorder = self._around.open_recorder(journal, header, stops, connection.is_real_time)
        with real_time() if connection.is_real_time else nullcontext(SIMULATED_TIME) as permitted:
            self._enter(
                RunState.ENABLING,
                stop_policy=RELEASE if self._is_released else self._policy.value,
                ramp_s=plan.ramp_s,
                motion_s=plan.motion_s,
                real_time=permitted,
            )
            try:
                self._enable_and_play(plan, backend, recorder)
            finally:
                # While the thread is still a real-time one: nothing comes between the cause and the stop.
                self._stop_arm()

    def _enable_and_play(self, plan: Plan, backend: Backend, recorder: Recorder) -> None:
        options, stops = self._task.options, self._around.stops
        torque_mode = options.mode is ControlMode.TORQUE
        control = torque_control(self._task.robot, plan, options.bandwidth_rad_s) if torque_mode else None
        raise_if_requested(stops)
        period_s = plan.period_ns * 1e-9
        state = backend.enable(options.mode, plan.limits.drive_limits, self._policy, options.watchdog_s, period_s)
        now = backend.clock.now_ns()
        guard = Guard(
            plan.limits,
            period_s=period_s,
            watchdog_s=options.watchdog_s,
            enabled_ns=now,
            stale_misses=options.missed,
            stale_s=options.lost_s,
        )
        metronome = Metronome(backend.clock, now + plan.period_ns, plan.period_ns, plan.cycles)
        arm = GuardedArm(backend, guard, state)
        latest_ns = round(options.stale_ms * 1e6)
        self._cycles = Cycles(plan, arm, metronome, recorder, stops, control, self._each_cycle, latest_ns)
        self._enter(RunState.RAMPING, drives=backend.capabilities.remarks)
        self._cycles.play()
        self._is_played = True

    def _each_cycle(self, cycles: Cycles) -> None:
        if self.record.state is RunState.RAMPING and cycles.plan.phase[cycles.metronome.index] == Phase.MOTION:
            self._enter(RunState.RUNNING)
        self._progress(cycles, self.record.state)

    def _stop_arm(self) -> None:
        """Stop the arm and let go of it, once; whoever is broken out of this before it is done begins anew."""
        if self._is_stopped:
            return
        stops, backend = self._around.stops, self._backend
        stops.acknowledge()
        try:
            if backend is not None:
                state = backend.stop(self._policy)
                if not state.faults and self._is_played and self._is_released:
                    state = release_settled(backend, state)
                self._holds = bool(state.enabled.any())
                if state.faults:
                    self._unconfirmed = f"while the arm was stopped: {state.faults[0]}"
        except BaseException as error:
            # Then the device's watchdog stops the arm.
            self._unconfirmed = f"the drives did not confirm the stop ({_reason(error)}): look at the arm"
        try:
            if backend is not None:
                backend.disconnect()
        except BaseException as error:
            self._unconfirmed = self._unconfirmed or f"the bus was not let go of ({_reason(error)}): reconnect the arm"
        stops.done()
        self._is_stopped = True

    def _conclude(self, end: RunState) -> RunRecord:
        lost, recording, problem = 0, None, self.record.problem
        if self._recorder is not None:
            remark = self._recorder.close()
            lost = self._recorder.lost
            recording = save_recording(self._around.folder, is_whole=end is RunState.FINISHED, lost_rows=lost)
            if remark is not None:
                recording = recording.model_copy(update={"partial": True, "remarks": (*recording.remarks, remark)})
            if end is RunState.FINISHED and not recording.files:
                problem = RunProblem(code=AcquisitionError.code, detail=f"no recording: {recording.remarks[-1]}")
        if self._unconfirmed is not None and problem is None:
            problem = RunProblem(code=AcquisitionError.code, detail=self._unconfirmed)
        if problem is not None and end is RunState.FINISHED:
            end = RunState.FAILED
        if end is RunState.FINISHED and (problem := self._loss()) is not None:
            end = RunState.DEGRADED
        self._enter(end, problem=problem, recording=recording)
        self._tell(end_event(self.record))
        return self.record

    def _loss(self) -> RunProblem | None:
        """Why so many samples of a motion that was played are missing; None where there are enough."""
        cycles, timing, options = self._cycles, self.record.timing, self._task.options
        if cycles is None or timing is None or cycles.kept_share >= options.least_kept:
            return None
        late, stale = int(cycles.late.max()), int(cycles.arm.stale.max())
        causes = {
            f"{timing.missed_periods} cycles were left out because the loop was late": timing.missed_periods,
            f"{stale} readings were not answered": stale,
            f"{late} answers came more than {options.stale_ms:g} ms later than usual": late,
        }
        worst = [cause for cause, count in sorted(causes.items(), key=lambda one: -one[1]) if count]
        kept = f"{100.0 * cycles.kept_share:.1f} % of the motion's samples were kept"
        least = f"{100.0 * options.least_kept:g} % are asked for"
        remedy = "use a quieter machine, a lower rate or a faster adapter, or allow it with --least-kept"
        detail = f"{', '.join(worst) or 'samples were lost'}: {kept}, {least}; {remedy}"
        return RunProblem(code=AcquisitionError.code, detail=detail)

    def _account(self) -> dict[str, Any]:
        cycles = self._cycles
        if cycles is None:
            return {}
        return {
            "played": cycles.played,
            "kept": cycles.kept_share,
            "timing": cycles.metronome.timing(cycles.arm.stale + cycles.late),
            "holds": self._holds,
            "worst_following": tuple(float(value) for value in cycles.worst_following),
        }

    def _enter(self, state: RunState, **changes: Any) -> None:
        self.record = self.record.moved(state, **changes)
        self._around.keep(self.record)
        transition = self.record.history[-1]
        self._tell(state_event(state, transition.at))
        if self._recorder is not None and self._backend is not None and not state.is_end:
            with suppress(AcquisitionError):  # a journal that takes nothing is found out by the next cycle
                self._recorder.event(self._backend.clock.now_ns(), self._journal_event(transition))

    def _journal_event(self, transition: Transition) -> dict[str, Any]:
        reason = self.record.stop if self.record.problem is None else self.record.problem.detail
        event = state_event(transition.state, transition.at)
        return event if reason is None else {**event, "reason": reason}

    def _tell(self, event: Any) -> None:
        try:
            self._around.report(event)
        except Exception:
            # An owner that cannot listen is no reason to let an arm fall.
            traceback.print_exc(file=sys.stderr)


def _outcome(cause: BaseException | None) -> tuple[RunState, dict[str, Any]]:
    if cause is None:
        return RunState.FINISHED, {}
    if isinstance(cause, StopAskedError):
        return cause.request.end, {"stop": cause.request.detail}
    return RunState.FAILED, {"problem": _problem(cause)}


def _problem(error: BaseException) -> RunProblem:
    """What went wrong, for the record; a fault of our own also with its traceback, for the log."""
    if isinstance(error, GuardViolationError):
        return RunProblem.of(error.violation)
    if isinstance(error, DriverError):
        return RunProblem(code=AcquisitionError.code, detail=f"{_reason(error)} ({error.kind})")
    if isinstance(error, TauscopeError):
        return RunProblem(code=error.code, detail=_reason(error))
    traceback.print_exception(error, file=sys.stderr)
    return RunProblem(code=INTERNAL, detail=f"{type(error).__name__}: {_reason(error)}; this is a fault of Tauscope's")


def _reason(error: BaseException) -> str:
    return one_line(str(error)) or type(error).__name__


def run_trajectory(
    robot: Robot,
    trajectory: Trajectory,
    connect: Callable[[], Connection],
    folder: Path,
    options: RunOptions | None = None,
    *,
    backend_name: str = DEFAULT_BACKEND,
    stops: Stops | None = None,
    report: Report | None = None,
) -> RunRecord:
    """Run a motion in this process, real time in one of its own. Raises AcquisitionError where the folder is taken."""
    options = options or RunOptions()
    prepare_folder(folder)
    record = new_record(robot.name, backend_name, options.mode.value)
    keep = partial(keep_record, folder)
    around = Surroundings(folder, stops or ManualStop(), keep, open_recorder, report or (lambda _event: None))
    run = Run(RunTask(robot, trajectory, options, connect), record, around)
    keep(record)
    return run.execute()


def prepare_folder(folder: Path) -> None:
    """Make a run's folder. Raises AcquisitionError where it does, or it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AcquisitionError(f"{folder}: the run's folder cannot be made ({error.strerror or error})") from error
    for name in (RUN_FILE, ORDER_FILE):
        if (folder / name).exists():
            raise AcquisitionError(f"{folder}: holds a run already; give another folder")


def open_recorder(path: Path, header: JournalHeader, stops: Stops, is_real_time: bool) -> Recorder:
    """Open a journal. Raises AcquisitionError where it cannot be created."""
    if not is_real_time:
        return DirectRecorder(path, header)
    recorder = RecorderProcess(path, header)
    try:
        recorder.wait_until_open(stops)
    except BaseException:
        recorder.close()
        raise
    return recorder


SETTLED_S = 0.5  # time for which every joint has to stand still [s]
STILL = 1e-3  # most that a joint may move in that time: some counts of an encoder [rad or m]
LONGEST_S = 5.0  # time after which an arm that does not come to rest stays held [s]
_LOOK_S = 0.05


def release_settled(backend: Backend, state: ArmState) -> ArmState:
    """Hold an arm that was just stopped until it stands still, then let go; one that moves stays held."""
    clock = backend.clock
    begin_ns = since_ns = clock.now_ns()
    place = state.position
    while clock.now_ns() - begin_ns < LONGEST_S * 1e9:
        if state.faults or not np.isfinite(state.position).all():
            return state
        if (np.abs(state.position - place) > STILL).any():
            place, since_ns = state.position, clock.now_ns()
        if clock.now_ns() - since_ns >= SETTLED_S * 1e9:
            return backend.stop(StopPolicy.TORQUE_OFF)
        clock.wait_until_ns(clock.now_ns() + round(_LOOK_S * 1e9))
        state = backend.stop(StopPolicy.HOLD)
    return state


def release(backend_name: str, robot: Robot, settings: Mapping[str, Any]) -> None:
    """Take the torque off an arm. Raises AcquisitionError where a drive is not reached, or is under power still."""
    backend = make_backend(backend_name, robot, settings).backend
    with translate_driver_errors():
        backend.connect()
        try:
            state = backend.stop(StopPolicy.TORQUE_OFF)
        finally:
            backend.disconnect()
    held = [joint.name for joint, is_held in zip(robot.joints, state.enabled, strict=True) if is_held]
    if held:
        raise AcquisitionError(f"{', '.join(held)}: still under power; switch the arm's power off, look at its drives")
    silent = [fault for fault in state.faults if fault.code == "silent"]
    if silent:
        raise AcquisitionError(f"{silent[0]}")
