"""Moving the arm: the run state machine, the control process, its guard and the recorder.

`RunProcess` runs a motion in a process of its own, `run_trajectory` in this one; `recover_runs` shows, at the next
start, what became of runs whose process is gone.
"""

from service.acquisition.backends import BACKENDS, Connection, make_backend
from service.acquisition.guard import Guard
from service.acquisition.guard_limits import GuardLimits, guard_limits
from service.acquisition.in_process import run_trajectory
from service.acquisition.options import RunOptions
from service.acquisition.order import BackendOrder, RunOrder, read_order, write_order
from service.acquisition.plan import Plan, make_plan
from service.acquisition.progress import Report
from service.acquisition.record import RecordingFiles, RunProblem, RunRecord, read_record
from service.acquisition.recovery import recover_run, recover_runs
from service.acquisition.run_process import RunProcess
from service.acquisition.states import TRANSITIONS, RunState, after_stop, may_follow
from service.acquisition.stop_request import ManualStop, StopRequest, StopSource
from service.acquisition.timing import Timing
from service.acquisition.violation import GuardViolationError, Rule, Violation

__all__ = [
    "BACKENDS",
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
