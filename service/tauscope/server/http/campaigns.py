"""Campaigns: requests, answers and what is special about this resource."""

from collections.abc import Callable, Iterator
from typing import Any, Literal
from urllib.parse import quote

from fastapi import Request
from fastapi.concurrency import contextmanager_in_threadpool
from pydantic import Field
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.diagnosis import DiagnosisDocument
from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.control.campaign import CampaignLinks, CampaignManager, CampaignOrder, CampaignWorkspace
from tauscope.server.control.run import RunWorkspace
from tauscope.server.http.analyses import DIAGNOSES, IDENTIFICATIONS
from tauscope.server.http.answers import (
    ENDINGS,
    AnswerModel,
    Identifier,
    JobAnswer,
    MotionLinks,
    collection,
    describe_damaged,
    describe_job,
    require_document,
    require_success,
)
from tauscope.server.http.excitations import EXCITATIONS
from tauscope.server.http.leases import permit_of
from tauscope.server.http.runs import RUNS
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.tasks.router import MovingResource
from tauscope.server.http.tasks.submission import (
    EXAMPLE_ROBOT,
    BackendRequest,
    RobotRequest,
    choose_backend,
    keep_robot,
    receive_request,
)
from tauscope.server.problems import problem_responses
from tauscope.server.queue.job_folder import JobState
from tauscope.server.queue.received_files import read_received_robot
from tauscope.server.queue.task_job import stage_workspace
from tauscope.tasks.campaign import CampaignOptions
from tauscope.tasks.run import BackendChoice


class CampaignRequest(RobotRequest, CampaignOptions):
    """Which campaign is wanted."""

    backend: BackendRequest = Field(default=BackendRequest(), description="which arm is moved")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": ("Everything as it comes, on the simulated arm", {"robot": EXAMPLE_ROBOT, "backend": {"name": "sim"}}),
    "options": (
        "Ordinary least squares from eight periods, without a held-out motion",
        {
            "robot": EXAMPLE_ROBOT,
            "backend": {"name": "sim", "time": "virtual"},
            "excitation": {"periods": 8, "seed": 3},
            "held_out": None,
            "identification": {"estimator": "ls"},
        },
    ),
}


StepName = Literal["design", "run", "held-out design", "held-out run", "identify", "diagnose"]


class CampaignStepAnswer(AnswerModel):
    name: StepName = Field(description="of the step")
    state: str = Field(description="waiting, or the state of its excitation, run, identification or diagnosis")
    link: str | None = Field(default=None, description="its excitation, run, identification or diagnosis")


class CampaignLinksAnswer(MotionLinks):
    recordings: tuple[str, ...] = Field(default=(), description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")
    identification: str | None = Field(default=None, description="its identification, exports included")
    diagnosis: str | None = Field(default=None, description="its diagnosis, where one was asked for")
    result: str | None = Field(default=None, description="its result, once it succeeded")


class CampaignAnswer(JobAnswer):
    backend: BackendChoice | None = Field(default=None, description="which arm is moved")
    steps: tuple[CampaignStepAnswer, ...] = Field(default=(), description="in their order")
    links: CampaignLinksAnswer = Field(description="where to go on")


class CampaignResult(AnswerModel):
    schema_: Literal["tauscope.campaign/1"] = Field(default="tauscope.campaign/1", alias="schema", description="form")
    identification: IdentificationDocument = Field(description="the same document as `tauscope identify --json`")
    diagnosis: DiagnosisDocument | None = Field(default=None, description="as `tauscope diagnose --json`, if asked for")
    steps: tuple[CampaignStepAnswer, ...] = Field(description="how it came about")
    links: CampaignLinksAnswer = Field(description="everything that was made on the way")


class CampaignStopAnswer(AnswerModel):
    id: str = Field(description="identifier of the campaign")
    state: JobState = Field(description="where it stood; it stops unless that is an end state")


def result_of(services: Services, identifier: str, root: str) -> CampaignResult:
    require_success(CAMPAIGNS.find(services, identifier))
    answer = CAMPAIGNS.describe(services, identifier, root)
    made = CAMPAIGNS.find(services, identifier).read_made()
    identification = IDENTIFICATIONS.finished(services, made.identification or "")
    content = require_document(identification.read_result(), identification.folder.name)
    document = IdentificationDocument.model_validate_json(content)
    diagnosis = None
    if made.diagnosis is not None:
        found = DIAGNOSES.finished(services, made.diagnosis)
        content = require_document(found.read_result(), made.diagnosis)
        diagnosis = DiagnosisDocument.model_validate_json(content)
    return CampaignResult(identification=document, diagnosis=diagnosis, steps=answer.steps, links=answer.links)


def _steps(services: Services, order: CampaignOrder, made: CampaignLinks, root: str) -> Iterator[CampaignStepAnswer]:
    steps: list[tuple[StepName, str, Callable[[Services, str], Any], str | None, bool]] = [
        ("design", "excitations", EXCITATIONS.find, made.excitation, True),
        ("held-out design", "excitations", EXCITATIONS.find, made.held_out_excitation, order.held_out is not None),
        ("run", "runs", RUNS.find, made.run, True),
        ("held-out run", "runs", RUNS.find, made.held_out_run, order.held_out is not None),
        ("identify", "identifications", IDENTIFICATIONS.find, made.identification, True),
        ("diagnose", "diagnoses", DIAGNOSES.find, made.diagnosis, order.diagnosis is not None),
    ]
    for name, plural, find, identifier, is_wanted in steps:
        if is_wanted and identifier is None:
            yield CampaignStepAnswer(name=name, state="waiting")
        elif is_wanted and identifier is not None:
            yield CampaignStepAnswer(
                name=name, state=_state(services, find, identifier), link=f"{root}/{plural}/{identifier}"
            )


def _state(services: Services, find: Callable[[Services, str], Any], identifier: str) -> str:
    try:
        folder = find(services, identifier)
    except NotFoundError:
        return "gone"
    record = folder.read_run() if isinstance(folder, RunWorkspace) else folder.read_record()
    return "damaged" if record is None else record.state.value


def _links(here: str, root: str, made: CampaignLinks, *, has_result: bool) -> CampaignLinksAnswer:
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


class Campaigns(MovingResource):
    @override
    def manager(self, services: Services) -> CampaignManager:
        return services.campaigns

    @override
    def find(self, services: Services, identifier: str) -> CampaignWorkspace:
        return CampaignWorkspace(services.campaigns.items.folder(identifier))

    @override
    def read_state(self, services: Services, identifier: str) -> JobState | None:
        record = self.find(services, identifier).read_record()
        return None if record is None else record.state

    @override
    def describe(self, services: Services, identifier: str, root: str) -> CampaignAnswer:
        workspace = self.find(services, identifier)
        here, made, order = f"{root}/campaigns/{identifier}", workspace.read_made(), workspace.read_order()
        if order is None:
            links = _links(here, root, made, has_result=False)
            return CampaignAnswer(**describe_damaged(identifier, here), links=links)
        fields = describe_job(workspace, here)
        links = _links(here, root, made, has_result=fields["state"] is JobState.SUCCEEDED)
        steps = tuple(_steps(services, order, made, root))
        return CampaignAnswer(**fields, robot=order.robot_name, backend=order.backend, steps=steps, links=links)

    @override
    async def submit(self, request: Request, services: Services) -> str:
        async with contextmanager_in_threadpool(
            stage_workspace(services.campaigns.items, CampaignWorkspace)
        ) as workspace:
            received = await receive_request(request, CampaignRequest, services.settings, workspace.robot)
            robot_file = await run_in_threadpool(keep_robot, received, workspace.robot, services.robots)
            robot = await services.reading.call(request, read_received_robot, workspace.robot, robot_file)
            backend = choose_backend(services.settings, received.document.backend, robot)
            permit = permit_of(request, services, backend.device(robot.name))
            order = CampaignOrder(
                robot_file=robot_file,
                robot_name=robot.name,
                backend=backend,
                **{name: getattr(received.document, name) for name in CampaignOptions.model_fields},
            )
            await run_in_threadpool(workspace.write_order, order)
            return await run_in_threadpool(services.campaigns.submit, workspace.folder, permit)


CAMPAIGNS = Campaigns(
    noun="a campaign",
    plural="campaigns",
    models=(CampaignRequest, CampaignAnswer),
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
_MOTION_PROBLEMS = ("robot-file", "excitation", "scenario", "acquisition", "recording", "identification")


@router.get(
    "/{identifier}/result",
    name="get_result_of_campaigns",
    summary="Fetch the result",
    responses=problem_responses("not-found", *ENDINGS, *_MOTION_PROBLEMS, "worker-lost", "internal"),
)
def get_result(request: Request, identifier: Identifier, services: ServicesDep) -> CampaignResult:
    """The identified model, and everything that led to it; else the problem that the campaign ended in."""
    return result_of(services, identifier, collection(request, 3))
