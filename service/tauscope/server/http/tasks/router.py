"""One router for every resource that performs a task: handed in, listed, followed by its events, ended."""

import json
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from anyio import to_thread
from fastapi import APIRouter, Depends, Header, Request, Response
from fastapi.concurrency import contextmanager_in_threadpool
from fastapi.sse import KEEPALIVE_COMMENT, EventSourceResponse, format_sse_event
from pydantic import BaseModel, Field, create_model
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.errors import NotFoundError
from tauscope.robot import RobotReport
from tauscope.server.control.run_manager import Manager
from tauscope.server.http.answers import MOTION, ROOT, SUBMISSION, After, AnswerModel, Identifier, Limit, PageAnswer
from tauscope.server.http.bodies import PartRule
from tauscope.server.http.leases import NO_BODY, LeaseToken
from tauscope.server.http.openapi import Examples, refer_to_model
from tauscope.server.http.reading import READING
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks import submission
from tauscope.server.http.tasks.event_feeds import EventFeeds, EventSource
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.job_folder import EndedEvent, JobFolder, ProgressEvent, StateEvent, StepEvent
from tauscope.server.queue.received_files import check_received_robot, read_received_robot
from tauscope.server.queue.task_job import stage_workspace
from tauscope.server.store.data_folder import FOLDERS
from tauscope.server.store.event_log import LoggedEvent

EVENT_MODELS = (StateEvent, StepEvent, ProgressEvent, EndedEvent)
HEARTBEAT_S = 10.0  # silence after which a comment says that the connection lives [s]
RETRY_MS = 1000  # how long a client waits before it connects again [ms]
PRESENCE_S = 1.0  # how often a client without news is looked for [s]


LastEvent = Annotated[
    int,
    Header(
        alias="Last-Event-ID",
        ge=0,
        le=2**53,
        description="id of the last event that is known; the answer begins with the next",
    ),
]


_STREAM = """\
Kinds: `state`, `step`, `progress` and `ended`, after which the stream ends. An event's id is its number:
`Last-Event-ID` goes on after it, also after a restart of the service. Comments keep a quiet connection alive."""


def add_events_route(router: APIRouter, noun: str, find: Callable[[Services, str], EventSource]) -> None:
    """Give a collection of jobs the route ``/{identifier}/events``."""

    def find_source(identifier: Identifier, services: ServicesDep) -> EventSource:
        return find(services, identifier)

    @router.get(
        "/{identifier}/events",
        name=f"follow_events_of_{router.prefix.strip('/')}",
        summary=f"Follow the events of {noun}",
        response_class=Response,
        responses={
            200: {"content": {"text/event-stream": {"schema": _stream_schema()}}, "description": _STREAM},
            204: {"description": "the job had ended before `Last-Event-ID`: do not connect again"},
            **problem_responses("not-found"),
        },
    )
    async def follow_events(
        request: Request,
        services: ServicesDep,
        source: Annotated[EventSource, Depends(find_source)],
        after: LastEvent = 0,
    ) -> Response:
        """Server-sent events, from the first one on."""
        first = await to_thread.run_sync(_find_end, source, limiter=services.followers)
        if first is not None and after >= first:
            return Response(status_code=204)
        stream = _stream(request, services.feeds, source, after)
        return EventSourceResponse(stream, headers={"X-Accel-Buffering": "no"})


async def _stream(request: Request, feeds: EventFeeds, source: EventSource, after: int) -> AsyncIterator[bytes]:
    """Everything that happens, as it is sent; ends with the job, the client or the service."""
    yield format_sse_event(retry=RETRY_MS)
    place, quiet_s = 0, 0.0
    with feeds.follow(source) as feed:
        while not await request.is_disconnected():
            events, place = feed.events[place:], len(feed.events)
            new = [event for event in events if event.number > after]
            if new:
                yield b"".join(map(_format_event, new))
                quiet_s = 0.0
            if feed.is_over and place == len(feed.events):
                return
            if place == len(feed.events) and not await feed.wait(PRESENCE_S):
                quiet_s += PRESENCE_S
            if quiet_s > HEARTBEAT_S:
                yield KEEPALIVE_COMMENT
                quiet_s = 0.0


def _find_end(source: EventSource) -> int | None:
    """Number of the end event; None where there is none yet."""
    if not source.has_ended():
        return None
    events = source.events.follow().read()
    return next((event.number for event in events if event.content.get("kind") == "ended"), None)


def _format_event(event: LoggedEvent) -> bytes:
    kind = event.content.get("kind")
    return format_sse_event(
        data_str=json.dumps(event.content, ensure_ascii=False),
        event=kind if isinstance(kind, str) else None,
        id=str(event.number),
    )


def _stream_schema() -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "event": {"type": "string", "enum": ["state", "step", "progress", "ended"]},
            "id": {"type": "string", "description": "number of the event, from 1"},
            "data": {
                "type": "string",
                "contentMediaType": "application/json",
                "contentSchema": {"anyOf": [refer_to_model(model) for model in EVENT_MODELS]},
            },
            "retry": {"type": "integer", "description": "how long to wait before connecting again [ms]"},
        },
    }


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

    @property
    def plural(self) -> str:
        return FOLDERS[self.singular]

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
    return [
        RobotFileAnswer(name=path.name, content=path.read_bytes().decode("utf-8", errors="replace"))
        for path in sorted(folder.iterdir())
        if path.is_file() and not path.is_symlink()
    ]
