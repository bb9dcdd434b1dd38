"""What is said of a run."""

from collections.abc import Callable
from dataclasses import dataclass

from tauscope.errors import NotFoundError
from tauscope.runtime.record import RunRecord
from tauscope.server.control.run_manager import run_recording_name
from tauscope.server.control.run_workspace import RunWorkspace
from tauscope.server.http.jobs.answers import shown_problem
from tauscope.server.http.runs.models import RecordingFormat, RunAnswer, RunLinks, RunRecordingAnswer
from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError, make_problem
from tauscope.server.store.event_log import EventLog

FORMATS: tuple[RecordingFormat, ...] = ("mcap", "csv", "parquet")


def find_run(services: Services, identifier: str) -> RunWorkspace:
    """The folder of a run.

    Raises
    ------
    NotFoundError
        if there is none
    """
    return RunWorkspace(services.runs.items.folder(identifier))


@dataclass(frozen=True)
class FollowedRun:
    """A run as those see it who follow its events: it ends when the desk has put everything in its place."""

    events: EventLog
    has_ended: Callable[[], bool]


def followed_run(services: Services, identifier: str) -> FollowedRun:
    """A run whose events are followed.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = find_run(services, identifier)

    def has_ended() -> bool:
        return services.runs.live(identifier) is None and workspace.has_ended()

    return FollowedRun(workspace.events, has_ended)


def describe(services: Services, identifier: str, root: str) -> RunAnswer:
    """The state of a run; one whose files are damaged is said to be so.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace, live = find_run(services, identifier), services.runs.live(identifier)
    here = f"{root}/runs/{identifier}"
    record, request = workspace.read_run(), workspace.read_request()
    if record is None or request is None:
        detail = f"files of {identifier} are missing or damaged; remove it and hand it in again"
        problem = make_problem("damaged", detail, here)
        return RunAnswer(id=identifier, state="damaged", problem=problem, links=_links(here, None, None, workspace))
    goes_on = live is not None and not record.state.is_end
    return RunAnswer(
        id=identifier,
        state=record.state,
        step=workspace.read_step() if goes_on else None,
        percent=live.percent if live is not None and goes_on else 100.0 * record.played,
        figures=dict(live.figures) if live is not None and goes_on else {},
        created=record.history[0].at,
        ended=record.history[-1].at if record.state.is_end else None,
        robot=record.robot,
        backend=request.backend,
        options=request.options,
        campaign=request.campaign,
        stop_policy=record.stop_policy,
        ramp_s=record.ramp_s,
        motion_s=record.motion_s,
        timing=record.timing,
        real_time=record.real_time,
        worst_following=record.worst_following,
        stop=record.stop,
        problem=shown_problem(workspace.problem(), here),
        recording=_recording(services, identifier, record),
        links=_links(here, request.excitation and f"{root}/excitations/{request.excitation}", record, workspace),
    )


def require_recording(services: Services, identifier: str, format_: RecordingFormat) -> RunWorkspace:
    """The folder of a run that left a recording of a format.

    Raises
    ------
    NotFoundError
        if there is no such run, or no such file
    ProblemError
        if the run goes on
    """
    workspace = find_run(services, identifier)
    if not workspace.has_ended() or services.runs.live(identifier) is not None:
        text = f"{identifier} goes on; ask for its recording when its state is an end state"
        raise ProblemError("not-finished", text, headers={"Retry-After": "2"})
    if not workspace.recording(format_).is_file():
        have = [name for name in FORMATS if workspace.recording(name).is_file()]
        hint = f"there is {', '.join(have)}" if have else "it ended before the arm moved"
        raise NotFoundError(f"run {identifier} left no {format_}: {hint}")
    return workspace


def _recording(services: Services, identifier: str, record: RunRecord) -> RunRecordingAnswer | None:
    """What a run left behind."""
    left, name = record.recording, run_recording_name(identifier)
    if left is None:
        return None
    is_kept = services.recordings.holds(name)
    return RunRecordingAnswer(
        name=name if is_kept else None,
        samples=left.samples,
        partial=left.partial,
        lost_rows=left.lost_rows,
        remarks=left.remarks,
    )


def _links(here: str, excitation: str | None, record: RunRecord | None, workspace: RunWorkspace) -> RunLinks:
    """Where to go on: to the recording, once there is one."""
    has_ended = record is not None and record.state.is_end
    recordings: dict[RecordingFormat, str] = {
        name: f"{here}/recording?format={name}" for name in FORMATS if has_ended and workspace.recording(name).is_file()
    }
    return RunLinks(
        self=here, events=f"{here}/events", stop=f"{here}/stop", excitation=excitation, recordings=recordings
    )
