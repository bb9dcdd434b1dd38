"""What is done, at the next start, about runs whose process is gone."""

import os
import signal
import time
from pathlib import Path

from tauscope.errors import AcquisitionError
from tauscope.recording.journal_process import wait_for_writer
from tauscope.runtime.processes import wait_for_lock
from tauscope.runtime.record import (
    JOURNAL_FILE,
    LOG_FILE,
    RUN_FILE,
    ProcessName,
    RunProblem,
    RunRecord,
    read_process,
    read_record,
    write_record,
)
from tauscope.runtime.recorder import UNKNOWN_LOSS, save_recording
from tauscope.runtime.states import RunState

INTERRUPTED = "interrupted"
"""Code of the problem of a run whose process is gone."""

PATIENCE_S = 5.0
"""Time that a control process without an owner may take to stop its arm before it is ended."""

_WRITER_S = 10.0
_POLL_S = 0.02
_GONE = (
    "the process that moved the arm is gone: the device's watchdog has stopped the arm; look at it, then acknowledge "
    "the watchdog's fault and start again"
)


_NEVER_MOVED = (
    "the process that was to move the arm ended before the arm was under power: nothing has moved; "
    f"{LOG_FILE} in the run's folder may say why"
)
_WITHOUT_POWER = (RunState.CREATED, RunState.CONNECTING)


def recover_runs(folder: Path, *, patience_s: float = PATIENCE_S) -> tuple[RunRecord, ...]:
    """Show every run that nobody carries out any more as interrupted, and save what its journal holds.

    A run whose owner lives is left to its owner. Nothing is ever moved by this. Raises AcquisitionError where a record
    is damaged, or cannot be written.

    `patience_s`: time that a control process whose owner is gone gets to stop its arm [s].
    """
    runs = sorted(path.parent for path in folder.glob(f"*/{RUN_FILE}"))
    recovered = (recover_run(run, patience_s=patience_s) for run in runs)
    return tuple(record for record in recovered if record is not None)


def recover_run(
    folder: Path, *, is_own: bool = False, was_asked_to_stop: bool = False, patience_s: float = PATIENCE_S
) -> RunRecord | None:
    """Show a run as interrupted if nobody carries it out any more, or as stopped where that kept it from beginning.

    Raises AcquisitionError where the record is damaged, or cannot be written.

    `patience_s`: time that a control process whose owner is gone gets to stop its arm [s]. Returns RunRecord or None:
    the new record; None where the run has ended by itself or goes on.
    """
    record = read_record(folder)
    if record.state.is_end or (not is_own and record.owner is not None and record.owner.is_alive):
        return None
    # Also one that was frozen before it could hold the folder: it must not wake up to a run that is over.
    for control in (record.control, read_process(folder)):
        if control is not None:
            _see_to_its_end(control, patience_s)
    lock = wait_for_lock(folder, patience_s)
    if lock is None:
        raise AcquisitionError(f"{folder}: its control process does not end; restart the machine and look at the arm")
    try:
        # It may have come to its end in the meantime.
        record = read_record(folder)
        if record.state.is_end:
            return None
        if was_asked_to_stop and record.state is RunState.CREATED:
            return _write(folder, record.moved(RunState.STOPPING).moved(RunState.STOPPED))
        return _interrupt(folder, record)
    finally:
        lock.release()


def _see_to_its_end(control: ProcessName, patience_s: float) -> None:
    """Wait for a control process that has no owner any more, and end it where it is itself frozen or stuck."""
    deadline = time.monotonic() + patience_s
    while control.is_alive:
        if time.monotonic() >= deadline:
            os.kill(control.pid, signal.SIGKILL)
            return
        time.sleep(_POLL_S)


def _interrupt(folder: Path, record: RunRecord) -> RunRecord:
    """Save what there is and write the end of a run whose process is gone."""
    recording = None
    journal = folder / JOURNAL_FILE
    if journal.exists():
        wait_for_writer(journal, _WRITER_S)
        recording = save_recording(folder, is_whole=False, lost_rows=UNKNOWN_LOSS)
    detail = _NEVER_MOVED if record.state in _WITHOUT_POWER and recording is None else _GONE
    problem = record.problem or RunProblem(code=INTERRUPTED, detail=detail)
    return _write(folder, record.moved(RunState.INTERRUPTED, problem=problem, recording=recording))


def _write(folder: Path, record: RunRecord) -> RunRecord:
    """Keep a record."""
    try:
        write_record(folder, record)
    except OSError as error:
        raise AcquisitionError(f"{folder}: the run's record cannot be written ({error.strerror or error})") from error
    return record
