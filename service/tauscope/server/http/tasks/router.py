"""One router for every resource that performs a task: handed in, listed, followed, ended."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import contextmanager_in_threadpool
from pydantic import BaseModel, Field, create_model
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.errors import NotFoundError
from tauscope.robot import RobotReport
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.xml_text import LARGEST_XML
from tauscope.server.control.run_manager import Manager
from tauscope.server.http.answers import MOTION, ROOT, SUBMISSION, After, AnswerModel, Identifier, Limit, PageAnswer
from tauscope.server.http.bodies import PartRule
from tauscope.server.http.leases import NO_BODY, LeaseToken
from tauscope.server.http.openapi import Examples
from tauscope.server.http.reading import READING
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks import submission
from tauscope.server.http.tasks.event_feeds import EventSource
from tauscope.server.http.tasks.events import add_events_route
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.job_folder import JobFolder
from tauscope.server.queue.received_files import check_received_robot, read_received_robot
from tauscope.server.queue.task_job import stage_workspace


class RobotFileAnswer(AnswerModel):
    name: str = Field(description="its bare name")
    content: str = Field(description="its text")


class JobRobotAnswer(AnswerModel):
    report: RobotReport = Field(description="the robot at a glance")
    robot_file: str = Field(description="which of the files is the robot file")
    files: list[RobotFileAnswer] = Field(description="robot file and URDF as they were sent")


@dataclass(frozen=True, eq=False, kw_only=True)
class Resource(ABC):
    """What is special about a resource; `words`: of handing in; `parts`: files of a form beside the robot's."""

    noun: str
    plural: str
    models: tuple[type[submission.RobotRequest], type[BaseModel]]
    workspace: type[Any]
    examples: Examples
    summary: str
    words: str
    problems: Sequence[str] = ()
    parts: Mapping[str, Any] = field(default_factory=dict)
    motion_problems: ClassVar[Sequence[str]] = ()

    @property
    def singular(self) -> str:
        return self.noun.rpartition(" ")[2]

    def path(self, identifier: str) -> str:
        return f"{ROOT}/{self.plural}/{identifier}"

    def find(self, services: Services, identifier: str) -> Any:
        """The folder of an item. Raises NotFoundError if there is none."""
        return self.workspace(services.items[self.singular].folder(identifier))

    def follow(self, services: Services, identifier: str) -> EventSource:
        """What has the events of an item. Raises NotFoundError if there is none."""
        return self.find(services, identifier)

    async def submit(self, request: Request, services: Services) -> str:
        """Take a request; returns an identifier. Raises ProblemError or TauscopeError if it is not valid."""
        settings, staged = services.settings, stage_workspace(services.items[self.singular], self.workspace)
        async with contextmanager_in_threadpool(staged) as workspace:
            rules = self.part_rules(settings, workspace)
            received = await submission.receive_request(request, self.models[0], settings, workspace.robot, rules)
            robot_file = await run_in_threadpool(self.put_robot, received, services, workspace)
            robot = await services.reading.call(request, read_received_robot, workspace.robot, robot_file)
            return await self.hand_over(
                submission.Submission(received.document, received.form, request, services, workspace, robot_file, robot)
            )

    def part_rules(self, _settings: Settings, _workspace: Any) -> dict[str, PartRule]:
        """The files that a form may bring beside the robot's, by part."""
        return {}

    def put_robot(self, received: submission.Received[Any], services: Services, workspace: Any) -> str:
        """Put the robot into its folder; returns the name of its file."""
        return submission.keep_robot(received, workspace.robot, services.robots)

    @abstractmethod
    async def hand_over(self, handed: submission.Submission[Any]) -> str: ...

    @abstractmethod
    def describe(self, services: Services, identifier: str) -> Any:
        """The answer; one whose files are damaged says so. Raises NotFoundError."""

    def router(self) -> APIRouter:
        router = APIRouter(prefix=f"/{self.plural}", tags=[self.plural])
        _add_submission(router, self)
        _add_list(router, self)
        _add_item(router, self)
        add_events_route(router, self.noun, self.follow)
        return router


def _add_submission(router: APIRouter, resource: Resource) -> None:
    request_model, answer_model = resource.models

    @router.post(
        "",
        name=f"create_{resource.singular}",
        status_code=202,
        summary=resource.summary,
        description=resource.words,
        response_model=answer_model,
        responses=problem_responses(*SUBMISSION, *resource.motion_problems, *resource.problems),
        openapi_extra=submission.request_body(request_model, resource.examples, resource.parts),
        dependencies=[Depends(_lease_header)] if resource.motion_problems else [],
    )
    async def hand_in(request: Request, response: Response, services: ServicesDep) -> Any:
        identifier = await resource.submit(request, services)
        answer = await run_in_threadpool(resource.describe, services, identifier)
        response.headers["Location"] = answer.links.self_
        return answer


def _add_list(router: APIRouter, resource: Resource) -> None:
    plural, answer_model = resource.plural, resource.models[1]
    entries: Any = {plural: (list[answer_model], Field(description="the newest first"))}
    list_model = create_model(
        f"{resource.singular.capitalize()}ListAnswer",
        __base__=PageAnswer,
        __doc__=f"{plural.capitalize()} that are kept.",
        **entries,
    )

    @router.get("", name=f"list_{plural}", summary=f"List {plural}", response_model=list_model)
    def list_items(services: ServicesDep, limit: Limit = 100, after: After = None) -> BaseModel:
        """The newest first."""
        known = services.items[resource.singular].identifiers()
        found = [each for each in known if after is None or each < after]
        page = []
        for each in found[:limit]:
            with suppress(NotFoundError):  # it was removed a moment ago
                page.append(resource.describe(services, each))
        return list_model(**{plural: page}, next=found[limit - 1] if len(found) > limit else None)


def _add_item(router: APIRouter, resource: Resource) -> None:
    @router.get(
        "/{identifier}",
        name=f"get_{resource.singular}",
        summary=f"Follow {resource.noun}",
        response_model=resource.models[1],
        responses=problem_responses("not-found"),
    )
    def get_item(identifier: Identifier, services: ServicesDep) -> Any:
        """Its state, and where to go on from there."""
        return resource.describe(services, identifier)

    @router.get(
        "/{identifier}/robot",
        name=f"get_robot_of_{resource.singular}",
        summary=f"Fetch the robot of {resource.noun}",
        responses=problem_responses("not-found", "damaged", "robot-file", *READING),
    )
    async def get_robot(request: Request, identifier: Identifier, services: ServicesDep) -> JobRobotAnswer:
        """Its joints, limits and frames, and the files that were sent."""
        workspace: JobFolder[Any] = await run_in_threadpool(resource.find, services, identifier)
        order = await run_in_threadpool(workspace.read_order)
        if order is None:
            raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it has no robot any more")
        return await describe_robot(request, services, workspace.robot, order.robot_file)


@dataclass(frozen=True, eq=False, kw_only=True)
class MovingResource(Resource):
    """One that moves an arm; `stop_words` and `remove_words` describe the routes that end it."""

    manager: Callable[[Services], Manager[Any]]
    stop_model: type[BaseModel]
    stop_words: str
    remove_words: str
    motion_problems: ClassVar[Sequence[str]] = MOTION

    @override
    def router(self) -> APIRouter:
        router = super().router()

        @router.post(
            "/{identifier}/stop",
            name=f"stop_{self.singular}",
            status_code=202,
            summary=f"Stop {self.noun}",
            description=self.stop_words,
            response_model=self.stop_model,
            responses={**problem_responses("not-found"), 202: {"description": "it stops, or had ended already"}},
            openapi_extra=NO_BODY,
        )
        async def stop_item(identifier: Identifier, services: ServicesDep) -> BaseModel:
            # Neither a thread of the pool nor a lock nor a disk is needed for one that goes on, whatever is stuck.
            state = self.manager(services).stop(identifier)
            if state is None:
                record = self.find(services, identifier).read_record()
                if record is None:
                    raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it does not go on")
                state = record.state
            return self.stop_model(id=identifier, state=state)

        @router.delete(
            "/{identifier}",
            name=f"remove_{self.singular}",
            status_code=204,
            summary=f"Remove {self.noun}",
            description=self.remove_words,
            responses=problem_responses("not-found", "not-finished"),
        )
        def remove_item(identifier: Identifier, services: ServicesDep) -> None:
            if not self.manager(services).remove(identifier):
                raise ProblemError("not-finished", f"{identifier} goes on; stop it, and remove it when it has ended")

        return router


async def describe_robot(request: Request, services: Services, folder: Path, robot_file: str) -> JobRobotAnswer:
    report = await services.reading.call(request, check_received_robot, folder, robot_file)
    files = await run_in_threadpool(_read_files, folder)
    return JobRobotAnswer(report=report, robot_file=robot_file, files=files)


def _lease_header(_lease: LeaseToken = None) -> None:
    """The lease that a request comes with; `permit_of` reads it."""


def _read_files(folder: Path) -> list[RobotFileAnswer]:
    answers = []
    for path in sorted(folder.iterdir()):
        if path.is_file() and not path.is_symlink():
            with path.open("rb") as file:
                content = file.read(max(LARGEST_ROBOT_FILE, LARGEST_XML))
            answers.append(RobotFileAnswer(name=path.name, content=content.decode("utf-8", errors="replace")))
    return answers
