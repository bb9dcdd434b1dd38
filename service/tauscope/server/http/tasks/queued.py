"""Resources whose tasks the queue performs: what is special about each is its models, documents and exports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Path, Response
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.diagnosis.extended_model import LARGEST_FILE
from tauscope.errors import ExportError, LimitExceededError, NotFoundError
from tauscope.export.formats import ExportFormat
from tauscope.robot.messages import nearest, shown
from tauscope.server.auth.gate import find_caller
from tauscope.server.http import answers
from tauscope.server.http.bodies import PartRule
from tauscope.server.http.openapi import file_contents
from tauscope.server.http.services import Services, ServicesDep, require_no_model
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks.router import Resource
from tauscope.server.http.tasks.submission import MODEL_FILE, Submission
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.job_folder import JobState
from tauscope.server.queue.task_job import SAVED_MODEL, OrderedRecording, TaskWorkspace
from tauscope.server.store.files import KeptFile

HTML = "text/html"
PAGE_HEADERS = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; sandbox"}
"""A report brings its style with it, runs no script, and may do nothing in the name of whoever reads it."""


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


_SHOWN = ("recordings", "held_out", "simulated", "refine", "options")
"""Fields of an order that its answer shows, where it has them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class QueuedTask(Resource):
    """`put_model`: puts a model that it works with into its place, and names it; `links`: further routes."""

    documents: Sequence[JobDocument]
    problems: Sequence[str] = ("recording", "not-found", "queue-full")
    work_problems: Sequence[str] = ("robot-file", "recording", "recording-mismatch", "identification")
    export_words: str = ""
    links: Sequence[str] = ()
    put_model: Callable[[Submission[Any]], str | None] | None = None

    def finished(self, services: Services, identifier: str) -> TaskWorkspace[Any]:
        """Raises NotFoundError if there is none, ProblemError if it has not succeeded."""
        workspace = self.find(services, identifier)
        answers.require_success(workspace)
        return workspace

    @override
    def router(self) -> APIRouter:
        router = super().router()
        self._add_cancelling(router)
        for document in self.documents:
            self._add_document(router, document)
        if self.workspace.formats:
            self._add_exports(router)
        return router

    def _add_cancelling(self, router: APIRouter) -> None:
        @router.delete(
            "/{identifier}",
            name=f"cancel_or_remove_{self.singular}",
            summary=f"Cancel or remove {self.noun}",
            response_model=self.models[1],
            responses={
                204: {"description": "it had ended, and was removed"},
                **problem_responses("not-found", "in-use"),
            },
        )
        def cancel_or_remove(identifier: answers.Identifier, services: ServicesDep) -> Any:
            """One that waits or runs is cancelled; one that has ended is removed, unless it is a model in use."""
            if self.find(services, identifier).has_ended():
                require_no_model(services, identifier)
            if services.jobs.cancel_or_remove(services.kinds[self.singular], identifier):
                return Response(status_code=204)
            return self.describe(services, identifier)

    def _add_document(self, router: APIRouter, document: JobDocument) -> None:
        @router.get(
            f"/{{identifier}}/{document.name}",
            name=f"get_{document.name.replace('-', '_')}_of_{self.plural}",
            summary=document.summary,
            description=document.description,
            response_class=Response,
            responses={
                200: document.answer,
                **problem_responses("not-found", *answers.ENDINGS, *self.work_problems, "worker-lost", "internal"),
            },
        )
        def get_document(identifier: answers.Identifier, services: ServicesDep) -> Response:
            content = self.finished(services, identifier).read_output(document.output)
            if content is None and document.missing is not None:
                raise NotFoundError(document.missing)
            headers = PAGE_HEADERS if document.media_type == HTML else None
            return Response(
                answers.require_document(content, identifier), headers=headers, media_type=document.media_type
            )

    def _add_exports(self, router: APIRouter) -> None:
        formats = self.workspace.formats
        content = file_contents(*{file.media_type for file in formats.values()})
        schema = {"enum": [kind.value for kind in formats]}
        problems = dict.fromkeys((*self.work_problems, "export"))

        @router.get(
            "/{identifier}/exports/{format}",
            name=f"get_export_of_{self.plural}",
            summary="Fetch an export",
            description=self.export_words,
            response_class=Response,
            responses={
                200: {"content": content, "description": "the file"},
                **problem_responses("not-found", *answers.ENDINGS, *problems, "worker-lost", "internal"),
            },
        )
        def get_export(
            identifier: answers.Identifier,
            format_: Annotated[
                str, Path(alias="format", description="what to write", json_schema_extra=schema, examples=["c"])
            ],
            services: ServicesDep,
        ) -> Response:
            if format_ not in formats:
                raise NotFoundError(f"there is no export {shown(format_)}; {nearest(format_, set(formats))}")
            workspace = self.finished(services, identifier)
            reason = workspace.refused_exports().get(format_)
            if reason is not None:
                raise ExportError(reason)
            file = formats[ExportFormat(format_)]
            disposition = {"Content-Disposition": f'attachment; filename="{file.name}"'}
            return Response(workspace.read_export(file.name), headers=disposition, media_type=file.media_type)

    @override
    def describe(self, services: Services, identifier: str) -> Any:
        answer, workspace = self.models[1], self.find(services, identifier)
        here, order = self.path(identifier), workspace.read_order()
        links: dict[str, Any] = {"self": here, "events": f"{here}/events"}
        if order is None:
            return answer(**answers.describe_damaged(identifier, here), links=links)
        fields, refused = answers.describe_job(workspace, here), workspace.refused_exports()
        if fields["state"] is JobState.SUCCEEDED:
            there = [e for e in self.documents if e.missing is None or (workspace.folder / e.output).is_file()]
            names = [*(document.name for document in there), *self.links]
            links |= {name.replace("-", "_"): f"{here}/{name}" for name in names}
            made = [k for k, file in workspace.formats.items() if (workspace.exports / file.name).is_file()]
            if made:
                links["exports"] = {kind.value: f"{here}/exports/{kind}" for kind in made if kind not in refused}
        fields |= {name: getattr(order, name) for name in _SHOWN if name in answer.model_fields}
        fields |= {"refused_exports": refused} if workspace.formats else {}
        return answer(**fields, robot=order.robot_name, links=links)

    @override
    def part_rules(self, settings: Settings, workspace: TaskWorkspace[Any]) -> dict[str, PartRule]:
        most, largest = settings.max_recordings, settings.max_upload_bytes
        rules = {role: PartRule(largest, workspace.uploads(role), most) for role in workspace.roles}
        if workspace.takes_model:
            rules["model"] = PartRule(LARGEST_FILE, workspace.uploads(SAVED_MODEL), default_name=MODEL_FILE)
        return rules

    @override
    async def hand_over(self, handed: Submission[Any]) -> str:
        return await run_in_threadpool(self._hand_over, handed)

    def _hand_over(self, handed: Submission[Any]) -> str:
        services, workspace, options = handed.services, handed.workspace, handed.document.options
        recordings = {role: order_recordings(role, handed) for role in workspace.roles}
        if recordings:
            check_recordings(recordings, services.settings.max_recordings)
        model = {} if self.put_model is None else {"model": self.put_model(handed)}
        workspace.write_order(workspace.order_type(**handed.robot_fields, **recordings, **model, options=options))
        caller = find_caller(handed.request.scope).name
        return services.jobs.submit(services.kinds[self.singular], workspace.folder, caller)


def order_recordings(role: str, handed: Submission[Any]) -> tuple[OrderedRecording, ...]:
    """Raises ProblemError if a file was sent but is not listed, NotFoundError if one is not there."""
    files: dict[str, KeptFile] = {file.name: file for file in handed.form.files.get(role, [])}
    listed: Sequence[str] | None = getattr(handed.document, role)
    names = list(files) if listed is None else listed
    unlisted = [name for name in files if name not in names]
    if unlisted:
        text = f"{role}: the file {unlisted[0]} was sent but is not listed; list it, or leave the list out"
        raise ProblemError("invalid-request", text)
    ordered = []
    for name in names:
        file = files.get(name)
        if file is not None:
            ordered.append(OrderedRecording(name=name, origin="uploaded", sha256=file.sha256))
        else:
            ordered.append(OrderedRecording(name=name, origin="server", sha256=handed.services.recordings.digest(name)))
    return tuple(ordered)


def check_recordings(recordings: Mapping[str, Sequence[OrderedRecording]], most: int) -> None:
    """Raises ProblemError if there is none or two are the same, LimitExceededError for too many."""
    if not recordings["recordings"]:
        text = "no recording was sent or named; send part recordings, or name recordings on the server"
        raise ProblemError("invalid-request", text)
    entries = [entry for listed in recordings.values() for entry in listed]
    if len(entries) > most:
        raise LimitExceededError(f"{len(entries)} recordings are more than the {most} accepted here; send fewer")
    seen: dict[str, str] = {}
    for entry in entries:
        if entry.sha256 in seen:
            hint = "a recording counts once, and never judges itself"
            raise ProblemError("invalid-request", f"{seen[entry.sha256]} and {entry.name} hold the same bytes; {hint}")
        seen[entry.sha256] = entry.name
