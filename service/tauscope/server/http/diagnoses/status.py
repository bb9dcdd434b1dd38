"""What is said of a diagnosis."""

from tauscope.server.http.diagnoses.models import DiagnosisAnswer, DiagnosisLinksAnswer
from tauscope.server.http.jobs.answers import damaged_fields, job_fields, require_success
from tauscope.server.http.services import Services
from tauscope.server.queue.diagnosis_workspace import DiagnosisWorkspace
from tauscope.server.queue.record import JobState


def find_diagnosis(services: Services, identifier: str) -> DiagnosisWorkspace:
    """The folder of a diagnosis.

    Raises
    ------
    NotFoundError
        if there is none
    """
    return DiagnosisWorkspace(services.diagnoses.items.folder(identifier))


def describe(services: Services, identifier: str, collection: str) -> DiagnosisAnswer:
    """The state of a diagnosis; one whose files are damaged is said to be so.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = find_diagnosis(services, identifier)
    here = f"{collection}/{identifier}"
    order = workspace.read_order()
    if order is None:
        return DiagnosisAnswer(**damaged_fields(identifier, here), links=_links(here, None, workspace))
    fields = job_fields(workspace, here)
    return DiagnosisAnswer(
        **fields,
        robot=order.robot_name,
        recordings=order.recordings,
        held_out=order.held_out,
        simulated=order.simulated,
        options=order.options,
        links=_links(here, fields["state"], workspace),
    )


def finished_diagnosis(services: Services, identifier: str) -> DiagnosisWorkspace:
    """The folder of a diagnosis that succeeded.

    Raises
    ------
    NotFoundError
        if there is none
    ProblemError
        if it has not succeeded: the problem that it ended in, or that it has not ended
    """
    workspace = find_diagnosis(services, identifier)
    require_success(workspace)
    return workspace


def _links(here: str, state: str | None, workspace: DiagnosisWorkspace) -> DiagnosisLinksAnswer:
    """Where to go on: to what came of it, once there is anything."""
    events = f"{here}/events"
    if state is not JobState.SUCCEEDED:
        return DiagnosisLinksAnswer(self=here, events=events)
    return DiagnosisLinksAnswer(
        self=here,
        events=events,
        result=f"{here}/result",
        plots=f"{here}/plots",
        report=f"{here}/report",
        model=f"{here}/model",
        next_trajectory=f"{here}/next-trajectory" if workspace.trajectory.is_file() else None,
    )
