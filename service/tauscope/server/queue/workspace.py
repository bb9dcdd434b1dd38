"""The folder of one job: what is in it whatever kind of job it is."""

from pathlib import Path

from tauscope.server.queue.job_folder import JobFolder
from tauscope.server.queue.record import EndedEvent, JobRecord, StateEvent
from tauscope.server.queue.stored import read_stored, write_stored


class Workspace(JobFolder):
    """A job in the queue: its state beside its step and its events.

    ``state.json`` is written by whoever leads the job only, ``progress`` by the work only, ``events.jsonl`` by both;
    input is written by whoever hands the job in, and never again.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet."""
        super().__init__(folder)
        self._record = folder / "state.json"

    def read_record(self) -> JobRecord | None:
        """The job's state, or None where the file is missing or damaged."""
        return read_stored(self._record, JobRecord)

    def has_ended(self) -> bool:
        """Whether nothing will happen to the job any more: it has ended, its state is damaged, or it is gone."""
        record = self.read_record()
        return record is None or record.state.is_end

    def write_record(self, record: JobRecord) -> None:
        """Keep the job's state, and tell it."""
        write_stored(self._record, record)
        self._tell_state(record)

    def tell_lost_end(self) -> None:
        """Tell the end of a job that ended when its events could not be written, or before there were events."""
        record = self.read_record()
        if record is None or not record.state.is_end:
            return
        if not self.has_told_end():
            self._tell_state(record)

    def _tell_state(self, record: JobRecord) -> None:
        """The event of a state."""
        time = record.ended or record.started or record.created
        if record.state.is_end:
            self.tell(EndedEvent(time=time, state=record.state, problem=record.problem))
        else:
            self.tell(StateEvent(time=time, state=record.state))
