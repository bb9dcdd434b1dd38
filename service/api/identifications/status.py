"""What is said of an identification."""

from collections.abc import Mapping

from service.api.identifications.models import IdentificationAnswer, LinksAnswer
from service.api.problems import Problem, ProblemError, make_problem
from service.api.services import Services
from service.jobs import EXPORT_FILES, JobRecord, JobState, Workspace


def describe(services: Services, identifier: str, collection: str) -> IdentificationAnswer:
    """The state of an identification; one whose files are damaged is said to be so.

    Parameters
    ----------
    services : Services
        where it is kept
    identifier : str
        of the identification
    collection : str
        path of the collection, for the links

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = Workspace(services.identifications.folder(identifier))
    here = f"{collection}/{identifier}"
    record, order = workspace.read_record(), workspace.read_order()
    if record is None or order is None:
        detail = f"files of {identifier} are missing or damaged; remove it and hand it in again"
        problem = make_problem("damaged", detail, here)
        return IdentificationAnswer(id=identifier, state="damaged", problem=problem, links=LinksAnswer(self=here))
    refused = workspace.refused_exports()
    return IdentificationAnswer(
        id=identifier,
        state=record.state,
        step=workspace.read_step() if record.state is JobState.RUNNING else None,
        created=record.created,
        started=record.started,
        ended=record.ended,
        robot=order.robot_name,
        recordings=order.recordings,
        held_out=order.held_out,
        options=order.options,
        problem=_problem(record, here),
        refused_exports=refused,
        links=_links(here, record.state, refused),
    )


def finished_workspace(services: Services, identifier: str) -> Workspace:
    """The folder of an identification that succeeded.

    Parameters
    ----------
    services : Services
        where it is kept
    identifier : str
        of the identification

    Raises
    ------
    NotFoundError
        if there is none
    ProblemError
        if it has not succeeded: the problem that it ended in, or that it has not ended
    """
    workspace = Workspace(services.identifications.folder(identifier))
    record = workspace.read_record()
    if record is None:
        raise ProblemError("damaged", f"the state of {identifier} is missing or damaged; remove it")
    if not record.state.is_end:
        text = f"{identifier} is {record.state}; ask for its state until that is an end state"
        raise ProblemError("not-finished", text, headers={"Retry-After": "2"})
    if record.problem is not None:
        raise ProblemError(record.problem.code, record.problem.detail)
    return workspace


def _problem(record: JobRecord, here: str) -> Problem | None:
    """The problem that a job ended in."""
    return None if record.problem is None else make_problem(record.problem.code, record.problem.detail, here)


def _links(here: str, state: JobState, refused: Mapping[str, str]) -> LinksAnswer:
    """Where to go on: to the result and the exports, once there are any."""
    if state is not JobState.SUCCEEDED:
        return LinksAnswer(self=here)
    formats = (export_format for export_format in EXPORT_FILES if export_format not in refused)
    exports = {export_format.value: f"{here}/exports/{export_format}" for export_format in formats}
    return LinksAnswer(self=here, result=f"{here}/result", exports=exports)
