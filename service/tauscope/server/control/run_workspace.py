"""The folder of a run: which file in it holds what."""

from datetime import UTC
from pathlib import Path

from tauscope.errors import AcquisitionError
from tauscope.runtime.record import (
    JOURNAL_FILE,
    RECORDING_STEM,
    RUN_FILE,
    RunProblem,
    RunRecord,
    new_record,
    read_record,
    write_record,
)
from tauscope.runtime.recovery import recover_run
from tauscope.runtime.states import RunState
from tauscope.server.control.run_order import RunRequestRecord
from tauscope.server.queue.job_folder import JobFolder
from tauscope.server.queue.record import EndedEvent, JobProblem, without_folders
from tauscope.server.queue.stored import read_stored, write_stored


class RunWorkspace(JobFolder):
    """Files of a run.

    ``request.json``, ``robot/`` and ``trajectory/`` are its input; ``control/`` belongs to the control process and
    holds its record, the journal and the recording. Before there is a control process, the record stands beside it.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a run's folder; nothing is opened yet."""
        super().__init__(folder)
        self.robot = folder / "robot"
        self.trajectories = folder / "trajectory"
        self.control = folder / "control"
        self.scenario = folder / "scenario.json"
        self._request = folder / "request.json"

    def prepare(self) -> None:
        """Make the folders that hold a run's input."""
        self.robot.mkdir()
        self.trajectories.mkdir()

    @property
    def trajectory(self) -> Path | None:
        """The file of the motion; None before there is one."""
        return next(iter(sorted(self.trajectories.glob("*"))), None)

    def recording(self, format_: str) -> Path:
        """Where the recording of a format lies; the journal is the MCAP, ramp included."""
        return self.control / (JOURNAL_FILE if format_ == "mcap" else f"{RECORDING_STEM}.{format_}")

    def read_request(self) -> RunRequestRecord | None:
        """What was asked for, or None where the file is missing or damaged."""
        return read_stored(self._request, RunRequestRecord)

    def write_request(self, request: RunRequestRecord) -> None:
        """Keep what was asked for."""
        write_stored(self._request, request)

    def create(self, request: RunRequestRecord) -> None:
        """Write the record of a run that has not begun."""
        backend, mode = request.backend.name, request.options.mode.value
        write_record(self.folder, new_record(request.robot_name, backend, mode))

    def read_run(self) -> RunRecord | None:
        """State and findings of the run, or None where the file is missing or damaged."""
        try:
            return read_record(self.control if self._has_begun else self.folder)
        except AcquisitionError:
            return None

    def has_ended(self) -> bool:
        """Whether nothing will happen to the run any more: it has ended, its record is damaged, or it is gone."""
        record = self.read_run()
        return record is None or record.state.is_end

    def end_before_start(self, state: RunState, problem: RunProblem | None) -> None:
        """Write the end of a run that no control process was started for.

        Raises
        ------
        OSError
            if it cannot be written
        """
        record = self.read_run()
        if record is None or record.state.is_end or self._has_begun:
            return
        write_record(self.folder, record.moved(RunState.STOPPING).moved(state, problem=problem))

    def recover(self) -> None:
        """Show a run that nobody carries out any more as interrupted; nothing happens to one that has ended.

        Raises
        ------
        AcquisitionError
            if its record is damaged, or its control process does not end
        """
        if self._has_begun:
            recover_run(self.control)
            return
        detail = "the service ended before this run began; hand it in again"
        self.end_before_start(RunState.INTERRUPTED, RunProblem(code="interrupted", detail=detail))

    def problem(self) -> JobProblem | None:
        """Why the run did not finish, without the server's folders; None where nothing is known against it."""
        record = self.read_run()
        if record is None or record.problem is None:
            return None
        return JobProblem(code=record.problem.code, detail=self.in_user_terms(record.problem.detail))

    def in_user_terms(self, text: str) -> str:
        """A message without the server's folders."""
        return without_folders(text, self.control, self.trajectories, self.robot, self.folder)

    def tell_end(self) -> None:
        """Tell that the run has ended, once."""
        record = self.read_run()
        if record is not None and record.state.is_end and not self.has_told_end():
            time = record.history[-1].at.astimezone(UTC)
            self.tell(EndedEvent(time=time, state=record.state, problem=self.problem()))

    @property
    def _has_begun(self) -> bool:
        """Whether the control process has a record of its own."""
        return (self.control / RUN_FILE).exists()
