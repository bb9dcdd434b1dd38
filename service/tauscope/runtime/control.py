"""The process that moves an arm, and does nothing else: ``python -m tauscope.runtime.control FOLDER``.

It reads ``order.json``, hears its owner on standard input (`tauscope.runtime.stop_listener`), tells events as JSON
lines on standard output, and keeps ``run.json``. Anything that a library prints goes to standard error.
"""

import json
import os
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tauscope.errors import AcquisitionError, TauscopeError
from tauscope.robot import read_robot
from tauscope.runtime import record as records
from tauscope.runtime.drivers import Connection, make_backend
from tauscope.runtime.loop import end_event
from tauscope.runtime.options import RunOrder, read_order
from tauscope.runtime.run import OpenRecorder, Run, RunTask, Surroundings, open_recorder
from tauscope.runtime.states import RunState
from tauscope.runtime.stop_listener import StopListener
from tauscope.trajectory import read_trajectory

_LARGEST_EVENT = 4096


def control(
    folder: Path, *, make: Callable[..., Connection] = make_backend, recorder: OpenRecorder = open_recorder
) -> int:
    report = _event_pipe()
    try:
        lock = records.RunLock(folder)
        order, record = read_order(folder), records.read_record(folder)
        if record.state is not RunState.CREATED:
            raise AcquisitionError(f"{folder}: the run is {record.state} already; a run is carried out once")
    except TauscopeError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    stops = StopListener(sys.stdin.fileno(), folder / records.STOP_FILE, order.options.heartbeat_s)
    keeper = records.RecordKeeper(folder)
    record = record.model_copy(update={"control": records.ProcessName.of(os.getpid())})
    keeper.keep(record)
    try:
        task = _task(order, folder, make)
        run = Run(task, record, Surroundings(folder, stops, keeper.keep, recorder, report))
    except TauscopeError as error:
        stops.done()
        problem = records.RunProblem(code=error.code, detail=str(error))
        record = record.moved(RunState.STOPPING, problem=problem).moved(RunState.FAILED)
        keeper.keep(record)
        report(end_event(record))
    else:
        run.execute()
    unkept = keeper.close(records.FLUSH_S if stops.is_real_time else threading.TIMEOUT_MAX)
    if unkept is not None:
        sys.stderr.write(f"{unkept}\n")
    lock.release()
    return 0 if unkept is None else 1


def _task(order: RunOrder, folder: Path, make: Callable[..., Connection]) -> RunTask:
    robot = read_robot(order.robot)
    trajectory = read_trajectory(order.trajectory, robot)
    name, settings = order.backend.name, order.backend.settings
    return RunTask(robot, trajectory, order.options, lambda: make(name, robot, settings, folder=folder))


def _event_pipe() -> Callable[[Mapping[str, Any]], None]:
    """Take standard output for events alone; an owner that does not read them misses them, and holds up nobody."""
    pipe = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    os.set_blocking(pipe, False)

    def report(event: Mapping[str, Any]) -> None:
        line = json.dumps(event).encode() + b"\n"
        if len(line) > _LARGEST_EVENT:  # only so much is written as a whole or not at all
            return
        try:
            os.write(pipe, line)
        except (BlockingIOError, BrokenPipeError):
            return

    return report


if __name__ == "__main__":
    sys.exit(control(Path(sys.argv[1])))
