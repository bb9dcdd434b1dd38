"""A run within this process: for the command line and for tests, in virtual time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tauscope.errors import AcquisitionError
from tauscope.recording.journal_rows import JournalHeader
from tauscope.robot import Robot
from tauscope.runtime.drivers import DEFAULT_BACKEND, Connection
from tauscope.runtime.options import ORDER_FILE, RunOptions
from tauscope.runtime.progress import Report
from tauscope.runtime.record import RUN_FILE, RunRecord, new_record, write_record
from tauscope.runtime.recorder import DirectRecorder, Recorder, RecorderProcess
from tauscope.runtime.run import Run
from tauscope.runtime.states import ManualStop, Stops
from tauscope.runtime.task import RunTask, Surroundings
from tauscope.trajectory import Trajectory


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
    """Run a motion in this process and return when it is over.

    A run in real time belongs into a process of its own (`tauscope.runtime.RunProcess`), which does nothing else.
    Raises AcquisitionError where the folder holds a run, or cannot be written to.
    """
    options = options or RunOptions()
    prepare_folder(folder)
    record = new_record(robot.name, backend_name, options.mode.value)
    keeper = _DirectKeeper(folder)
    around = Surroundings(folder, stops or ManualStop(), keeper, open_recorder, report or _nobody)
    run = Run(RunTask(robot, trajectory, options, connect), record, around)
    keeper.keep(record)
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
    """Open a journal in the way that suits the arm's time.

    Raises AcquisitionError where the journal cannot be created.
    """
    if not is_real_time:
        return DirectRecorder(path, header)
    recorder = RecorderProcess(path, header)
    try:
        recorder.wait_until_open(stops)
    except BaseException:
        recorder.close()
        raise
    return recorder


class _DirectKeeper:
    """Writes the record at once: in virtual time nobody is late."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keep(self, record: RunRecord) -> None:
        """Keep the newest record."""
        try:
            write_record(self._folder, record)
        except OSError as error:
            place = f"{self._folder}: the run's record cannot be written"
            raise AcquisitionError(f"{place} ({error.strerror or error})") from error


def _nobody(event: Any) -> None:
    del event
