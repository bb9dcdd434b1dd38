"""Resources whose tasks the queue performs: what is special about each is its models, documents and exports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fastapi import APIRouter, Request
from fastapi.concurrency import contextmanager_in_threadpool
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.errors import LimitExceededError
from tauscope.server.auth.gate import find_caller
from tauscope.server.http.answers import describe_damaged, describe_job, require_success
from tauscope.server.http.bodies import PartRule
from tauscope.server.http.services import Services
from tauscope.server.http.tasks.router import (
    JobDocument,
    Resource,
    add_cancelling,
    add_document_route,
    add_export_route,
)
from tauscope.server.http.tasks.submission import Received, keep_robot, receive_request
from tauscope.server.problems import ProblemError
from tauscope.server.queue.job_folder import JobState
from tauscope.server.queue.queue import JobKind
from tauscope.server.queue.received_files import read_received_robot
from tauscope.server.queue.task_job import OrderedRecording, TaskWorkspace, stage_workspace
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.files import KeptFile
from tauscope.server.store.recordings import RecordingStore

_SHOWN = ("recordings", "held_out", "simulated", "refine", "options")
"""Fields of an order that its answer shows, where it has them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class QueuedTask(Resource):
    """`further`: more fields of an order; `further_parts`: folder and limit [bytes] of other files; `links`: routes."""

    kind: Callable[[Services], JobKind]
    workspace: type[TaskWorkspace[Any]]
    documents: Sequence[JobDocument]
    problems: Sequence[str] = ("recording", "not-found", "queue-full")
    work_problems: Sequence[str] = ("robot-file", "recording", "recording-mismatch", "identification")
    export_words: str = ""
    links: Sequence[str] = ()
    further: Callable[[Received[Any], Services, Any], dict[str, Any]] = lambda *_: {}
    further_parts: Mapping[str, tuple[str, int]] = field(default_factory=dict)

    @override
    def items(self, services: Services) -> ItemStore:
        return self.kind(services).items

    @override
    def find(self, services: Services, identifier: str) -> TaskWorkspace[Any]:
        return self.workspace(self.items(services).folder(identifier))

    def finished(self, services: Services, identifier: str) -> TaskWorkspace[Any]:
        """Raises NotFoundError if there is none, ProblemError if it has not succeeded."""
        workspace = self.find(services, identifier)
        require_success(workspace)
        return workspace

    @override
    def router(self) -> APIRouter:
        router = super().router()
        add_cancelling(router, self, self.kind)
        for document in self.documents:
            add_document_route(router, self.finished, document, self.work_problems)
        if self.workspace.formats:
            add_export_route(router, self.finished, self.workspace.formats, self.export_words)
        return router

    @override
    def describe(self, services: Services, identifier: str, root: str) -> Any:
        answer, workspace = self.models[1], self.find(services, identifier)
        here, order = f"{root}/{self.plural}/{identifier}", workspace.read_order()
        links: dict[str, Any] = {"self": here, "events": f"{here}/events"}
        if order is None:
            return answer(**describe_damaged(identifier, here), links=links)
        fields, refused = describe_job(workspace, here), workspace.refused_exports()
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
    async def submit(self, request: Request, services: Services) -> str:
        settings = services.settings
        async with contextmanager_in_threadpool(stage_workspace(self.items(services), self.workspace)) as workspace:
            most, largest = settings.max_recordings, settings.max_upload_bytes
            rules = {role: PartRule(largest, workspace.uploads(role), most) for role in workspace.roles}
            for part, (folder, limit) in self.further_parts.items():
                rules[part] = PartRule(limit, workspace.uploads(folder), default_name=f"{part}.json")
            received = await receive_request(request, self.models[0], settings, workspace.robot, rules)
            robot_file = await run_in_threadpool(keep_robot, received, workspace.robot, services.robots)
            robot = await services.reading.call(request, read_received_robot, workspace.robot, robot_file)
            wanted = {"robot_file": robot_file, "robot_name": robot.name}
            caller = find_caller(request.scope).name
            return await run_in_threadpool(self._submit, received, services, workspace, wanted, caller)

    def _submit(
        self,
        received: Received[Any],
        services: Services,
        workspace: TaskWorkspace[Any],
        wanted: Mapping[str, Any],
        caller: str,
    ) -> str:
        recordings = {role: order_recordings(role, received, services.recordings) for role in workspace.roles}
        if recordings:
            check_recordings(recordings, services.settings.max_recordings)
        given: dict[str, Any] = {**wanted, **recordings}
        given |= {"options": received.document.options, **self.further(received, services, workspace)}
        workspace.write_order(workspace.order_type(**given))
        return services.jobs.submit(self.kind(services), workspace.folder, caller)


def order_recordings(role: str, received: Received[Any], store: RecordingStore) -> tuple[OrderedRecording, ...]:
    """Raises ProblemError if a file was sent but is not listed, NotFoundError if one is not there."""
    files: dict[str, KeptFile] = {file.name: file for file in received.form.files.get(role, [])}
    listed: Sequence[str] | None = getattr(received.document, role)
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
            ordered.append(OrderedRecording(name=name, origin="server", sha256=store.digest(name)))
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
