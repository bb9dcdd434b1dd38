"""What is said of an excitation."""

from tauscope.server.http.excitations.models import ExcitationAnswer, ExcitationLinks
from tauscope.server.http.jobs.answers import damaged_fields, job_fields, require_success
from tauscope.server.http.services import Services
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace
from tauscope.server.queue.record import JobState


def find_excitation(services: Services, identifier: str) -> ExcitationWorkspace:
    """The folder of an excitation.

    Raises
    ------
    NotFoundError
        if there is none
    """
    return ExcitationWorkspace(services.excitations.items.folder(identifier))


def finished_excitation(services: Services, identifier: str) -> ExcitationWorkspace:
    """The folder of an excitation that succeeded.

    Raises
    ------
    NotFoundError
        if there is none
    ProblemError
        if it has not succeeded: the problem that it ended in, or that it has not ended
    """
    workspace = find_excitation(services, identifier)
    require_success(workspace)
    return workspace


def describe(services: Services, identifier: str, collection: str) -> ExcitationAnswer:
    """The state of an excitation; one whose files are damaged is said to be so.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = find_excitation(services, identifier)
    here = f"{collection}/{identifier}"
    order = workspace.read_order()
    if order is None:
        return ExcitationAnswer(**damaged_fields(identifier, here), links=_links(here, has_result=False))
    fields = job_fields(workspace, here)
    links = _links(here, has_result=fields["state"] is JobState.SUCCEEDED)
    return ExcitationAnswer(**fields, robot=order.robot_name, options=order.options, links=links)


def _links(here: str, *, has_result: bool) -> ExcitationLinks:
    """Where to go on: to the document and the trajectory, once there are any."""
    if not has_result:
        return ExcitationLinks(self=here, events=f"{here}/events")
    return ExcitationLinks(self=here, events=f"{here}/events", result=f"{here}/result", trajectory=f"{here}/trajectory")
