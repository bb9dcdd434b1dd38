"""The record of a run, kept as ``run.json``: its state and files; its process, and the lock on its folder."""

import fcntl
import os
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from pydantic import AwareDatetime, Field, ValidationError

from tauscope.errors import AcquisitionError
from tauscope.files import write_atomically
from tauscope.runtime.guard import Violation
from tauscope.runtime.states import RunState, may_follow
from tauscope.runtime.timing import RealTime, Timing
from tauscope.strict_model import StrictModel


def child_environment() -> dict[str, str]:
    """Environment of a child process: it imports the modules that this process has, and computes in one thread."""
    source = str(Path(__file__).resolve().parents[2])
    known = os.environ.get("PYTHONPATH")
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": f"{source}{os.pathsep}{known}" if known else source}


def read_process_start(pid: int) -> int | None:
    """When a process was started, in the kernel's ticks; None where there is no such process."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name before it stands in parentheses and may hold anything.
    fields = status.rpartition(")")[2].split()
    return None if fields[0] in "ZX" else int(fields[19])


LOCK_FILE = ".lock"
_POLL_S = 0.02


class RunLock:
    def __init__(self, folder: Path) -> None:
        """Take the folder. Raises AcquisitionError where another process holds it."""
        self._descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            raise AcquisitionError(f"{folder}: another process carries this run out; wait for it or stop it") from None

    def release(self) -> None:
        os.close(self._descriptor)


def wait_for_lock(folder: Path, patience_s: float) -> RunLock | None:
    """Take a folder as soon as nobody holds it; None where it is still held after `patience_s` [s]."""
    deadline = time.monotonic() + patience_s
    while True:
        try:
            return RunLock(folder)
        except AcquisitionError:
            if time.monotonic() >= deadline:
                return None
            time.sleep(_POLL_S)


RUN_FILE = "run.json"
JOURNAL_FILE = "journal.mcap"
STOP_FILE = "stop"
LOG_FILE = "control.log"
PROCESS_FILE = ".control"
RECORDING_STEM = "recording"


class ProcessName(StrictModel):
    """One process of this machine, told from a later one of the same number."""

    pid: int = Field(description="number of the process")
    start: int | None = Field(description="when it was started, in the kernel's ticks")

    @staticmethod
    def of(pid: int) -> "ProcessName":
        return ProcessName(pid=pid, start=read_process_start(pid))

    @property
    def is_alive(self) -> bool:
        start = read_process_start(self.pid)
        return start is not None and self.start in (None, start)


def write_process(folder: Path, pid: int) -> None:
    """Keep the process of a run as soon as it is started. Raises OSError where the disk does not take it."""
    write_atomically(folder / PROCESS_FILE, ProcessName.of(pid).model_dump_json().encode())


def read_process(folder: Path) -> ProcessName | None:
    """The process that was started for a run; None where none was, or nobody knows."""
    try:
        return ProcessName.model_validate_json((folder / PROCESS_FILE).read_bytes())
    except (OSError, ValidationError):
        return None


class Transition(StrictModel):
    state: RunState = Field(description="the state")
    at: AwareDatetime = Field(description="the moment")


class RunProblem(StrictModel):
    code: str = Field(description="code of the error, as in tauscope.errors, or of the way the run ended")
    detail: str = Field(description="one line: what is wrong, where, and what to do")
    rule: str | None = Field(default=None, description="the guard's rule, where the guard objected")
    joint: str | None = Field(default=None, description="the joint that it objected to")
    value: float | None = Field(default=None, description="what it found")
    limit: float | None = Field(default=None, description="what it would have allowed")

    @staticmethod
    def of(violation: Violation) -> "RunProblem":
        return RunProblem(
            code=AcquisitionError.code,
            detail=str(violation),
            rule=violation.rule.value,
            joint=violation.joint,
            value=violation.value,
            limit=violation.limit,
        )


class RecordingFiles(StrictModel):
    samples: int = Field(description="samples of the motion, without the ramp")
    partial: bool = Field(description="whether the motion was not played to its end, or samples were lost")
    lost_rows: int = Field(description="cycles that the journal did not take: its disk was behind; -1 where unknown")
    files: tuple[str, ...] = Field(description="files of the recording in the run's folder, beside the journal")
    remarks: tuple[str, ...] = Field(default=(), description="what is missing, and why; one line each")


class RunRecord(StrictModel):
    form: Literal["tauscope.run/1"] = Field(default="tauscope.run/1", description="name and version of this form")
    state: RunState = Field(description="where the run stands")
    robot: str = Field(description="name of the arm")
    backend: str = Field(description="name of the backend")
    mode: str = Field(description="who closes the loop: position or torque")
    history: tuple[Transition, ...] = Field(description="the states so far, in order")
    owner: ProcessName | None = Field(default=None, description="the process that started the run")
    control: ProcessName | None = Field(default=None, description="the process that moves the arm")
    stop_policy: str | None = Field(default=None, description="how the arm is stopped")
    ramp_s: float | None = Field(default=None, description="time from the first cycle to the motion's start")
    motion_s: float | None = Field(default=None, description="length of the motion")
    drives: tuple[str, ...] = Field(default=(), description="what the drives lack, and what is done instead")
    holds: bool | None = Field(default=None, description="whether drives were powered at the end; null: unknown")
    played: float = Field(default=0.0, description="part of ramp and motion that was played, 0 to 1")
    kept: float | None = Field(default=None, description="part of the motion's samples that was kept, 0 to 1")
    timing: Timing | None = Field(default=None, description="how well the run kept its time")
    real_time: RealTime | None = Field(default=None, description="what the loop was given of what it asked for")
    worst_following: tuple[float, ...] = Field(default=(), description="largest distance of arm and target, by joint")
    stop: str | None = Field(default=None, description="who asked for the stop, and how; null where nobody did")
    problem: RunProblem | None = Field(default=None, description="why the run did not finish")
    recording: RecordingFiles | None = Field(default=None, description="what the run left behind")

    def moved(self, state: RunState, now: datetime | None = None, **changes: object) -> "RunRecord":
        """The record after a transition. Raises ValueError if that state may not follow: a fault of the caller's."""
        if not may_follow(self.state, state):
            raise ValueError(f"a run that is {self.state} cannot become {state}")
        history = (*self.history, Transition(state=state, at=now or datetime.now(UTC)))
        return self.model_copy(update={"state": state, "history": history, **changes})


def new_record(robot: str, backend: str, mode: str, now: datetime | None = None) -> RunRecord:
    created = Transition(state=RunState.CREATED, at=now or datetime.now(UTC))
    owner = ProcessName.of(os.getpid())
    return RunRecord(state=RunState.CREATED, robot=robot, backend=backend, mode=mode, history=(created,), owner=owner)


def write_record(folder: Path, record: RunRecord) -> None:
    """Write ``run.json``, whole or not at all. Raises OSError where the disk does not take it."""
    write_atomically(folder / RUN_FILE, record.model_dump_json(indent=1).encode())


def keep_record(folder: Path, record: RunRecord) -> RunRecord:
    """Write ``run.json`` and return the record. Raises AcquisitionError where the disk does not take it."""
    try:
        write_record(folder, record)
    except OSError as error:
        raise AcquisitionError(f"{folder}: the run's record cannot be written ({error.strerror or error})") from error
    return record


def read_record(folder: Path) -> RunRecord:
    """Read ``run.json``. Raises AcquisitionError where there is none, or it is damaged."""
    path = folder / RUN_FILE
    try:
        return RunRecord.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        raise AcquisitionError(f"{path}: there is no such run") from None
    except OSError as error:
        raise AcquisitionError(f"{path}: cannot be read ({error.strerror or error})") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "document"
        raise AcquisitionError(f"{path}: is not a run's record ({place}: {first['msg']})") from None


FLUSH_S = 5.0  # time that the disk may take for the last record


class RecordKeeper:
    """Writes the newest record; records that are overtaken while the disk is busy are left out."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._newest: RunRecord | None = None
        self._problem: str | None = None
        self._is_closed = False
        self._changed = threading.Condition()
        # A daemon: a thread that the disk holds up must not hold up the end of the process.
        self._thread = threading.Thread(target=self._work, name="run-record", daemon=True)
        self._thread.start()

    def keep(self, record: RunRecord) -> None:
        with self._changed:
            self._newest = record
            self._changed.notify_all()

    def close(self, patience_s: float = FLUSH_S) -> str | None:
        """Why the last record did not reach the disk within `patience_s` [s]; None where it did."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        self._thread.join(patience_s)
        if self._thread.is_alive():
            return (
                f"{self._folder}: the run's record was not written within {patience_s:g} s: the disk does not take it"
            )
        return self._problem

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._is_closed)
                record, self._newest = self._newest, None
            if record is None:
                return
            try:
                keep_record(self._folder, record)
                self._problem = None
            except AcquisitionError as error:
                self._problem = str(error)
