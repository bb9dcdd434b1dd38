"""What is said of an identification."""

from collections.abc import Mapping

from tauscope.export.formats import EXPORT_FILES
from tauscope.server.http.identifications.models import IdentificationAnswer, LinksAnswer
from tauscope.server.http.jobs.answers import damaged_fields, job_fields, require_success
from tauscope.server.http.services import Services
from tauscope.server.queue.identification_workspace import IdentificationWorkspace
from tauscope.server.queue.record import JobState


def find_identification(services: Services, identifier: str) -> IdentificationWorkspace:
    """The folder of an identification.

    Raises
    ------
    NotFoundError
        if there is none
    """
    return IdentificationWorkspace(services.identifications.items.folder(identifier))


def describe(services: Services, identifier: str, collection: str) -> IdentificationAnswer:
    """The state of an identification; one whose files are damaged is said to be so.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = find_identification(services, identifier)
    here = f"{collection}/{identifier}"
    order = workspace.read_order()
    if order is None:
        return IdentificationAnswer(**damaged_fields(identifier, here), links=_links(here, None, {}))
    fields, refused = job_fields(workspace, here), workspace.refused_exports()
    return IdentificationAnswer(
        **fields,
        robot=order.robot_name,
        recordings=order.recordings,
        held_out=order.held_out,
        options=order.options,
        refused_exports=refused,
        links=_links(here, fields["state"], refused),
    )


def finished_identification(services: Services, identifier: str) -> IdentificationWorkspace:
    """The folder of an identification that succeeded.

    Raises
    ------
    NotFoundError
        if there is none
    ProblemError
        if it has not succeeded: the problem that it ended in, or that it has not ended
    """
    workspace = find_identification(services, identifier)
    require_success(workspace)
    return workspace


def _links(here: str, state: str | None, refused: Mapping[str, str]) -> LinksAnswer:
    """Where to go on: to the result and the exports, once there are any."""
    events = f"{here}/events"
    if state is not JobState.SUCCEEDED:
        return LinksAnswer(self=here, events=events)
    formats = (export_format for export_format in EXPORT_FILES if export_format not in refused)
    exports = {export_format.value: f"{here}/exports/{export_format}" for export_format in formats}
    return LinksAnswer(
        self=here,
        events=events,
        result=f"{here}/result",
        plots=f"{here}/plots",
        report=f"{here}/report",
        exports=exports,
    )
