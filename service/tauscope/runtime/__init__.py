"""Moving the arm: the run state machine, the control process, its guard and the recorder.

`RunProcess` runs a motion in a process of its own, `run_trajectory` in this one; `recover_runs` shows, at the next
start, what became of runs whose process is gone.
"""

from tauscope.runtime.drivers import Connection, driver_names, make_backend
from tauscope.runtime.guard import Guard, GuardLimits, GuardViolationError, Rule, Violation, guard_limits
from tauscope.runtime.in_process import run_trajectory
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder, read_order, write_order
from tauscope.runtime.plan import Plan, make_plan
from tauscope.runtime.progress import Report
from tauscope.runtime.record import RecordingFiles, RunProblem, RunRecord, read_record
from tauscope.runtime.recovery import recover_run, recover_runs
from tauscope.runtime.run_process import RunProcess
from tauscope.runtime.states import TRANSITIONS, ManualStop, RunState, StopRequest, StopSource, after_stop, may_follow
from tauscope.runtime.timing import Timing

__all__ = [
    "TRANSITIONS",
    "BackendOrder",
    "Connection",
    "Guard",
    "GuardLimits",
    "GuardViolationError",
    "ManualStop",
    "Plan",
    "RecordingFiles",
    "Report",
    "Rule",
    "RunOptions",
    "RunOrder",
    "RunProblem",
    "RunProcess",
    "RunRecord",
    "RunState",
    "StopRequest",
    "StopSource",
    "Timing",
    "Violation",
    "after_stop",
    "driver_names",
    "guard_limits",
    "make_backend",
    "make_plan",
    "may_follow",
    "read_order",
    "read_record",
    "recover_run",
    "recover_runs",
    "run_trajectory",
    "write_order",
]
