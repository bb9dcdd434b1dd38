"""One router for every resource that performs a task: handed in, listed, followed, its outputs fetched, removed."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Depends, Path, Request, Response
from pydantic import BaseModel, Field, create_model
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.errors import ExportError, NotFoundError
from tauscope.export.formats import ExportFile, ExportFormat
from tauscope.robot import RobotReport
from tauscope.robot.messages import nearest, shown
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.xml_text import LARGEST_XML
from tauscope.server.control.run_manager import Manager
from tauscope.server.http.answers import (
    ENDINGS,
    MOTION,
    SUBMISSION,
    After,
    AnswerModel,
    Identifier,
    Limit,
    PageAnswer,
    collection,
    require_document,
)
from tauscope.server.http.leases import NO_BODY, LeaseToken
from tauscope.server.http.openapi import Examples, file_contents
from tauscope.server.http.reading import READING
from tauscope.server.http.services import Services, ServicesDep, require_no_model
from tauscope.server.http.tasks.event_feeds import EventSource
from tauscope.server.http.tasks.events import add_events_route
from tauscope.server.http.tasks.submission import RobotRequest, request_body
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.job_folder import JobFolder
from tauscope.server.queue.queue import JobKind
from tauscope.server.queue.received_files import check_received_robot
from tauscope.server.store.data_folder import ItemStore

HTML = "text/html"
PAGE_HEADERS = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; sandbox"}
"""A report brings its style with it, runs no script, and may do nothing in the name of whoever reads it."""


class RobotFileAnswer(AnswerModel):
    name: str = Field(description="its bare name")
    content: str = Field(description="its text")


class JobRobotAnswer(AnswerModel):
    report: RobotReport = Field(description="the robot at a glance")
    robot_file: str = Field(description="which of the files is the robot file")
    files: list[RobotFileAnswer] = Field(description="robot file and URDF as they were sent")


@dataclass(frozen=True)
class JobDocument:
    """`output`: its name among the outputs; `missing`: what is said where the task may make none, and made none."""

    name: str
    output: str
    summary: str
    description: str
    answer: dict[str, Any]
    media_type: str = "application/json"
    missing: str | None = None


def text_document(name: str, output: str, media_type: str, summary: str, words: str, same: str) -> JobDocument:
    """A document that is no JSON; `same` is the option that writes the same file."""
    answer = {"content": file_contents(media_type), "description": f"the same {same}"}
    missing = None if media_type == HTML else f"no {name} is kept here; hand it in again"
    return JobDocument(name, output, summary, words, answer, media_type, missing)


def result_document(noun: str, verb: str, model: type[BaseModel]) -> JobDocument:
    answer = {"model": model, "description": f"the same document as `tauscope {verb} --json`"}
    words = f"The result of {noun} that succeeded; else the problem that it ended in."
    return JobDocument("result", "result.json", "Fetch the result", words, answer)


def report_document(verb: str) -> JobDocument:
    text = "The report as one page: no script, no request to anywhere, ready to print."
    return text_document("report", "report.html", HTML, "Fetch the report", text, f"page as `tauscope {verb} --report`")


def plots_document(noun: str, model: type[BaseModel], words: str) -> JobDocument:
    answer, summary = {"model": model, "description": words}, "Fetch the data of its figures"
    return JobDocument("plots", "plots.json", summary, f"What figures of {noun} are drawn from.", answer)


@dataclass(frozen=True, eq=False, kw_only=True)
class Resource(ABC):
    """What is special about a resource; `words`: of handing in; `parts`: files of a form beside the robot's."""

    noun: str
    plural: str
    models: tuple[type[RobotRequest], type[BaseModel]]
    examples: Examples
    summary: str
    words: str
    problems: Sequence[str] = ()
    parts: Mapping[str, Any] = field(default_factory=dict)
    motion_problems: ClassVar[Sequence[str]] = ()

    @property
    def singular(self) -> str:
        return self.noun.rpartition(" ")[2]

    @abstractmethod
    def items(self, services: Services) -> ItemStore: ...

    @abstractmethod
    def find(self, services: Services, identifier: str) -> Any:
        """The folder of an item. Raises NotFoundError if there is none."""

    def follow(self, services: Services, identifier: str) -> EventSource:
        """What has the events of an item. Raises NotFoundError if there is none."""
        return self.find(services, identifier)

    @abstractmethod
    async def submit(self, request: Request, services: Services) -> str:
        """Take a request; returns an identifier. Raises ProblemError or TauscopeError if it is not valid."""

    @abstractmethod
    def describe(self, services: Services, identifier: str, root: str) -> Any:
        """The answer; one whose files are damaged says so. Raises NotFoundError. `root`: path of the interface."""

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
        openapi_extra=request_body(request_model, resource.examples, resource.parts),
        dependencies=[Depends(_lease_header)] if resource.motion_problems else [],
    )
    async def hand_in(request: Request, response: Response, services: ServicesDep) -> Any:
        identifier = await resource.submit(request, services)
        answer = await run_in_threadpool(resource.describe, services, identifier, collection(request, 1))
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
    def list_items(request: Request, services: ServicesDep, limit: Limit = 100, after: After = None) -> BaseModel:
        """The newest first."""
        root, found = collection(request, 1), resource.items(services).identifiers()
        found = [each for each in found if after is None or each < after]
        page = []
        for each in found[:limit]:
            with suppress(NotFoundError):  # it was removed a moment ago
                page.append(resource.describe(services, each, root))
        return list_model(**{plural: page}, next=found[limit - 1] if len(found) > limit else None)


def _add_item(router: APIRouter, resource: Resource) -> None:
    @router.get(
        "/{identifier}",
        name=f"get_{resource.singular}",
        summary=f"Follow {resource.noun}",
        response_model=resource.models[1],
        responses=problem_responses("not-found"),
    )
    def get_item(request: Request, identifier: Identifier, services: ServicesDep) -> Any:
        """Its state, and where to go on from there."""
        return resource.describe(services, identifier, collection(request, 2))

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


def add_cancelling(router: APIRouter, resource: Resource, kind: Callable[[Services], JobKind]) -> None:
    """Give a resource of queued jobs the route ``DELETE /{identifier}``."""

    @router.delete(
        "/{identifier}",
        name=f"cancel_or_remove_{resource.singular}",
        summary=f"Cancel or remove {resource.noun}",
        response_model=resource.models[1],
        responses={204: {"description": "it had ended, and was removed"}, **problem_responses("not-found", "in-use")},
    )
    def cancel_or_remove(request: Request, identifier: Identifier, services: ServicesDep) -> Any:
        """One that waits or runs is cancelled; one that has ended is removed, unless it is a model in use."""
        if resource.find(services, identifier).has_ended():
            require_no_model(services, identifier)
        if services.jobs.cancel_or_remove(kind(services), identifier):
            return Response(status_code=204)
        return resource.describe(services, identifier, collection(request, 2))


@dataclass(frozen=True, eq=False, kw_only=True)
class MovingResource(Resource):
    """One that moves an arm; `stop_words` and `remove_words` describe the routes that end it."""

    stop_model: type[BaseModel]
    stop_words: str
    remove_words: str
    motion_problems: ClassVar[Sequence[str]] = MOTION

    @abstractmethod
    def manager(self, services: Services) -> Manager[Any]: ...

    @abstractmethod
    def read_state(self, services: Services, identifier: str) -> Any:
        """The state in its folder; None where that is damaged."""

    @override
    def items(self, services: Services) -> ItemStore:
        return self.manager(services).items

    @override
    def router(self) -> APIRouter:
        router = super().router()
        self._add_ending(router)
        return router

    def _add_ending(self, router: APIRouter) -> None:
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
            state = self.manager(services).stop(identifier) or self.read_state(services, identifier)
            if state is None:
                raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it does not go on")
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


Finished = Callable[[Services, str], Any]  # the folder of a job that succeeded


def add_document_route(router: APIRouter, finished: Finished, document: JobDocument, problems: Sequence[str]) -> None:
    @router.get(
        f"/{{identifier}}/{document.name}",
        name=f"get_{document.name.replace('-', '_')}_of_{router.prefix.strip('/')}",
        summary=document.summary,
        description=document.description,
        response_class=Response,
        responses={
            200: document.answer,
            **problem_responses("not-found", *ENDINGS, *problems, "worker-lost", "internal"),
        },
    )
    def get_document(identifier: Identifier, services: ServicesDep) -> Response:
        content = finished(services, identifier).read_output(document.output)
        if content is None and document.missing is not None:
            raise NotFoundError(document.missing)
        headers = PAGE_HEADERS if document.media_type == HTML else None
        return Response(require_document(content, identifier), headers=headers, media_type=document.media_type)


def add_export_route(
    router: APIRouter, finished: Finished, formats: Mapping[ExportFormat, ExportFile], words: str
) -> None:
    """Give a resource the route ``/{identifier}/exports/{format}``."""
    content = file_contents(*{file.media_type for file in formats.values()})
    schema = {"enum": [kind.value for kind in formats]}

    @router.get(
        "/{identifier}/exports/{format}",
        name=f"get_export_of_{router.prefix.strip('/')}",
        summary="Fetch an export",
        description=words,
        response_class=Response,
        responses={
            200: {"content": content, "description": "the file"},
            **problem_responses(
                "not-found", *ENDINGS, "export", "recording", "identification", "worker-lost", "internal"
            ),
        },
    )
    def get_export(
        identifier: Identifier,
        format_: Annotated[
            str, Path(alias="format", description="what to write", json_schema_extra=schema, examples=["c"])
        ],
        services: ServicesDep,
    ) -> Response:
        if format_ not in formats:
            raise NotFoundError(f"there is no export {shown(format_)}; {nearest(format_, set(formats))}")
        workspace = finished(services, identifier)
        reason = workspace.refused_exports().get(format_)
        if reason is not None:
            raise ExportError(reason)
        file = formats[ExportFormat(format_)]
        disposition = {"Content-Disposition": f'attachment; filename="{file.name}"'}
        return Response(workspace.read_export(file.name), headers=disposition, media_type=file.media_type)


async def describe_robot(request: Request, services: Services, folder: FilePath, robot_file: str) -> JobRobotAnswer:
    report = await services.reading.call(request, check_received_robot, folder, robot_file)
    files = await run_in_threadpool(_read_files, folder)
    return JobRobotAnswer(report=report, robot_file=robot_file, files=files)


def _lease_header(_lease: LeaseToken = None) -> None:
    """The lease that a request comes with; `permit_of` reads it."""


def _read_files(folder: FilePath) -> list[RobotFileAnswer]:
    answers = []
    for path in sorted(folder.iterdir()):
        if path.is_file() and not path.is_symlink():
            with path.open("rb") as file:
                content = file.read(max(LARGEST_ROBOT_FILE, LARGEST_XML))
            answers.append(RobotFileAnswer(name=path.name, content=content.decode("utf-8", errors="replace")))
    return answers
