"""What is said of a campaign."""

from collections.abc import Iterator
from typing import Literal
from urllib.parse import quote

from tauscope.diagnosis import DiagnosisDocument
from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.control.campaign_order import CampaignLinks, CampaignOrder
from tauscope.server.control.campaign_workspace import CampaignWorkspace
from tauscope.server.http.campaigns.models import (
    CampaignAnswer,
    CampaignLinksAnswer,
    CampaignResult,
    CampaignStepAnswer,
)
from tauscope.server.http.diagnoses.status import find_diagnosis, finished_diagnosis
from tauscope.server.http.excitations.status import find_excitation
from tauscope.server.http.identifications.status import find_identification, finished_identification
from tauscope.server.http.jobs.answers import damaged_fields, job_fields, require_document, require_success
from tauscope.server.http.runs.status import find_run
from tauscope.server.http.services import Services
from tauscope.server.queue.record import JobState
from tauscope.server.queue.workspace import Workspace

WAITING, GONE = "waiting", "gone"


def find_campaign(services: Services, identifier: str) -> CampaignWorkspace:
    """The folder of a campaign.

    Raises
    ------
    NotFoundError
        if there is none
    """
    return CampaignWorkspace(services.campaigns.items.folder(identifier))


def describe(services: Services, identifier: str, root: str) -> CampaignAnswer:
    """The state of a campaign; one whose files are damaged is said to be so.

    Raises
    ------
    NotFoundError
        if there is none
    """
    workspace = find_campaign(services, identifier)
    here, made, order = f"{root}/campaigns/{identifier}", workspace.read_made(), workspace.read_order()
    if order is None:
        links = _links(here, root, made, has_result=False)
        return CampaignAnswer(**damaged_fields(identifier, here), links=links)
    fields = job_fields(workspace, here)
    links = _links(here, root, made, has_result=fields["state"] is JobState.SUCCEEDED)
    steps = tuple(_steps(services, order, made, root))
    return CampaignAnswer(**fields, robot=order.robot_name, backend=order.backend, steps=steps, links=links)


def result_of(services: Services, identifier: str, root: str) -> CampaignResult:
    """What came of a campaign that succeeded.

    Raises
    ------
    NotFoundError
        if there is none, or its identification was removed
    ProblemError
        if it has not succeeded
    """
    require_success(find_campaign(services, identifier))
    answer = describe(services, identifier, root)
    made = find_campaign(services, identifier).read_made()
    identification = finished_identification(services, made.identification or "")
    content = require_document(identification.read_result(), identification.folder.name)
    document = IdentificationDocument.model_validate_json(content)
    diagnosis = None
    if made.diagnosis is not None:
        found = finished_diagnosis(services, made.diagnosis)
        content = require_document(found.read_result(), made.diagnosis)
        diagnosis = DiagnosisDocument.model_validate_json(content)
    return CampaignResult(identification=document, diagnosis=diagnosis, steps=answer.steps, links=answer.links)


def _steps(services: Services, order: CampaignOrder, made: CampaignLinks, root: str) -> Iterator[CampaignStepAnswer]:
    """Every step with its state."""
    yield _excitation_step(services, "design", made.excitation, root)
    if order.held_out is not None:
        yield _excitation_step(services, "held-out design", made.held_out_excitation, root)
    yield _run_step(services, "run", made.run, root)
    if order.held_out is not None:
        yield _run_step(services, "held-out run", made.held_out_run, root)
    yield _identification_step(services, made.identification, root)
    if order.diagnosis is not None:
        yield _diagnosis_step(services, made.diagnosis, root)


def _identification_step(services: Services, identifier: str | None, root: str) -> CampaignStepAnswer:
    """The identification and its state."""
    if identifier is None:
        return CampaignStepAnswer(name="identify", state=WAITING)
    try:
        state = _job_state(find_identification(services, identifier))
    except NotFoundError:
        state = GONE
    return CampaignStepAnswer(name="identify", state=state, link=f"{root}/identifications/{identifier}")


def _diagnosis_step(services: Services, identifier: str | None, root: str) -> CampaignStepAnswer:
    """The diagnosis and its state."""
    if identifier is None:
        return CampaignStepAnswer(name="diagnose", state=WAITING)
    try:
        state = _job_state(find_diagnosis(services, identifier))
    except NotFoundError:
        state = GONE
    return CampaignStepAnswer(name="diagnose", state=state, link=f"{root}/diagnoses/{identifier}")


def _excitation_step(
    services: Services, name: Literal["design", "held-out design"], identifier: str | None, root: str
) -> CampaignStepAnswer:
    """A design and its state."""
    if identifier is None:
        return CampaignStepAnswer(name=name, state=WAITING)
    try:
        state = _job_state(find_excitation(services, identifier))
    except NotFoundError:
        state = GONE
    return CampaignStepAnswer(name=name, state=state, link=f"{root}/excitations/{identifier}")


def _run_step(
    services: Services, name: Literal["run", "held-out run"], identifier: str | None, root: str
) -> CampaignStepAnswer:
    """A run and its state."""
    if identifier is None:
        return CampaignStepAnswer(name=name, state=WAITING)
    try:
        record = find_run(services, identifier).read_run()
        state = "damaged" if record is None else record.state.value
    except NotFoundError:
        state = GONE
    return CampaignStepAnswer(name=name, state=state, link=f"{root}/runs/{identifier}")


def _job_state(workspace: Workspace) -> str:
    """The state of a job."""
    record = workspace.read_record()
    return "damaged" if record is None else record.state.value


def _links(here: str, root: str, made: CampaignLinks, *, has_result: bool) -> CampaignLinksAnswer:
    """Where to go on."""
    identification = made.identification
    return CampaignLinksAnswer(
        self=here,
        events=f"{here}/events",
        stop=f"{here}/stop",
        recordings=tuple(f"{root}/recordings/{quote(name)}" for name in made.recordings),
        held_out=tuple(f"{root}/recordings/{quote(name)}" for name in made.held_out),
        identification=None if identification is None else f"{root}/identifications/{identification}",
        diagnosis=None if made.diagnosis is None else f"{root}/diagnoses/{made.diagnosis}",
        result=f"{here}/result" if has_result else None,
    )
