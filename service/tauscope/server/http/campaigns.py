"""Campaigns: requests, answers and what is special about this resource."""

from collections.abc import Iterator
from typing import Any, Literal
from urllib.parse import quote

from pydantic import Field
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.diagnosis import DiagnosisDocument
from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.control.campaign import CampaignLinks, CampaignOrder, CampaignWorkspace
from tauscope.server.http import answers
from tauscope.server.http.analyses import DIAGNOSES, IDENTIFICATIONS
from tauscope.server.http.excitations import EXCITATIONS
from tauscope.server.http.leases import permit_of
from tauscope.server.http.runs import RUNS
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.tasks import submission
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import MovingResource, Resource
from tauscope.server.problems import problem_responses
from tauscope.server.queue.job_folder import JobState
from tauscope.tasks.campaign import CampaignOptions
from tauscope.tasks.run import BackendChoice


class CampaignRequest(submission.RobotRequest, CampaignOptions):
    """Which campaign is wanted."""

    backend: submission.BackendRequest = Field(default=submission.BackendRequest(), description="which arm is moved")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": (
        "Everything as it comes, on the simulated arm",
        {"robot": submission.EXAMPLE_ROBOT, "backend": {"name": "sim"}},
    ),
    "options": (
        "Ordinary least squares from eight periods, without a held-out motion",
        {
            "robot": submission.EXAMPLE_ROBOT,
            "backend": {"name": "sim", "time": "virtual"},
            "excitation": {"periods": 8, "seed": 3},
            "held_out": None,
            "identification": {"estimator": "ls"},
        },
    ),
}


StepName = Literal["design", "run", "held-out design", "held-out run", "identify", "diagnose"]


class CampaignStepAnswer(answers.AnswerModel):
    name: StepName = Field(description="of the step")
    state: str = Field(description="waiting, or the state of its excitation, run, identification or diagnosis")
    link: str | None = Field(default=None, description="its excitation, run, identification or diagnosis")


class CampaignLinksAnswer(answers.MotionLinks):
    recordings: tuple[str, ...] = Field(default=(), description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")
    identification: str | None = Field(default=None, description="its identification, exports included")
    diagnosis: str | None = Field(default=None, description="its diagnosis, where one was asked for")
    result: str | None = Field(default=None, description="its result, once it succeeded")


class CampaignAnswer(answers.JobAnswer):
    backend: BackendChoice | None = Field(default=None, description="which arm is moved")
    steps: tuple[CampaignStepAnswer, ...] = Field(default=(), description="in their order")
    links: CampaignLinksAnswer = Field(description="where to go on")


class CampaignResult(answers.AnswerModel):
    schema_: Literal["tauscope.campaign/1"] = Field(default="tauscope.campaign/1", alias="schema", description="form")
    identification: IdentificationDocument = Field(description="the same document as `tauscope identify --json`")
    diagnosis: DiagnosisDocument | None = Field(default=None, description="as `tauscope diagnose --json`, if asked for")
    steps: tuple[CampaignStepAnswer, ...] = Field(description="how it came about")
    links: CampaignLinksAnswer = Field(description="everything that was made on the way")


class CampaignStopAnswer(answers.AnswerModel):
    id: str = Field(description="identifier of the campaign")
    state: JobState = Field(description="where it stood; it stops unless that is an end state")


def _steps(services: Services, order: CampaignOrder, made: CampaignLinks) -> Iterator[CampaignStepAnswer]:
    steps: list[tuple[StepName, Resource, str | None, bool]] = [
        ("design", EXCITATIONS, made.excitation, True),
        ("held-out design", EXCITATIONS, made.held_out_excitation, order.held_out is not None),
        ("run", RUNS, made.run, True),
        ("held-out run", RUNS, made.held_out_run, order.held_out is not None),
        ("identify", IDENTIFICATIONS, made.identification, True),
        ("diagnose", DIAGNOSES, made.diagnosis, order.diagnosis is not None),
    ]
    for name, resource, identifier, is_wanted in steps:
        if is_wanted:
            state = "waiting" if identifier is None else _state(services, resource, identifier)
            yield CampaignStepAnswer(name=name, state=state, link=identifier and resource.path(identifier))


def _state(services: Services, resource: Resource, identifier: str) -> str:
    try:
        record = resource.find(services, identifier).read_record()
    except NotFoundError:
        return "gone"
    return "damaged" if record is None else record.state.value


def _links(here: str, made: CampaignLinks, *, has_result: bool) -> CampaignLinksAnswer:
    return CampaignLinksAnswer(
        self=here,
        events=f"{here}/events",
        stop=f"{here}/stop",
        recordings=tuple(f"{answers.ROOT}/recordings/{quote(name)}" for name in made.recordings),
        held_out=tuple(f"{answers.ROOT}/recordings/{quote(name)}" for name in made.held_out),
        identification=made.identification and IDENTIFICATIONS.path(made.identification),
        diagnosis=made.diagnosis and DIAGNOSES.path(made.diagnosis),
        result=f"{here}/result" if has_result else None,
    )


class Campaigns(MovingResource):
    @override
    def describe(self, services: Services, identifier: str) -> CampaignAnswer:
        workspace, here = self.find(services, identifier), self.path(identifier)
        made, order = workspace.read_made(), workspace.read_order()
        if order is None:
            links = _links(here, made, has_result=False)
            return CampaignAnswer(**answers.describe_damaged(identifier, here), links=links)
        fields = answers.describe_job(workspace, here)
        links = _links(here, made, has_result=fields["state"] is JobState.SUCCEEDED)
        steps = tuple(_steps(services, order, made))
        return CampaignAnswer(**fields, robot=order.robot_name, backend=order.backend, steps=steps, links=links)

    @override
    async def hand_over(self, handed: submission.Submission[CampaignRequest]) -> str:
        services, workspace, document = handed.services, handed.workspace, handed.document
        backend = submission.choose_backend(services.settings, document.backend, handed.robot)
        permit = permit_of(handed.request, services, backend.device(handed.robot.name))
        options = {name: getattr(document, name) for name in CampaignOptions.model_fields}
        await run_in_threadpool(workspace.write_order, CampaignOrder(**handed.robot_fields, backend=backend, **options))
        return await run_in_threadpool(services.campaigns.submit, workspace.folder, permit)


CAMPAIGNS = Campaigns(
    noun="a campaign",
    models=(CampaignRequest, CampaignAnswer),
    workspace=CampaignWorkspace,
    manager=lambda services: services.campaigns,
    examples=EXAMPLES,
    summary="Begin a campaign",
    words="Designs a motion, runs it, runs a second one that the model is judged by, and identifies the arm.\n\n"
    "The campaign has the arm until its motions are done. Follow `Location` until it has ended, or stop it"
    " at any time.",
    stop_model=CampaignStopAnswer,
    stop_words="Stops the arm first, then everything else of it; legal in every state, any number of times; needs no"
    " body.",
    remove_words="One that has ended is removed; its excitations, runs, recordings and identification stay.",
)

router = CAMPAIGNS.router()
_WORK_PROBLEMS = dict.fromkeys(
    ("excitation", "scenario", "acquisition", *IDENTIFICATIONS.work_problems, *DIAGNOSES.work_problems)
)


@router.get(
    "/{identifier}/result",
    name="get_result_of_campaigns",
    summary="Fetch the result",
    responses=problem_responses("not-found", *answers.ENDINGS, *_WORK_PROBLEMS, "worker-lost", "internal"),
)
def get_result(identifier: answers.Identifier, services: ServicesDep) -> CampaignResult:
    """The identified model, and everything that led to it; else the problem that the campaign ended in."""
    workspace = CAMPAIGNS.find(services, identifier)
    answers.require_success(workspace)
    answer, made = CAMPAIGNS.describe(services, identifier), workspace.read_made()
    document = _read_result(services, IDENTIFICATIONS, made.identification or "")
    found = None if made.diagnosis is None else _read_result(services, DIAGNOSES, made.diagnosis)
    return CampaignResult(
        identification=IdentificationDocument.model_validate_json(document),
        diagnosis=None if found is None else DiagnosisDocument.model_validate_json(found),
        steps=answer.steps,
        links=answer.links,
    )


def _read_result(services: Services, task: QueuedTask, identifier: str) -> bytes:
    return answers.require_document(task.finished(services, identifier).read_result(), identifier)
