"""From a request to a job: what was sent is written into the job's folder and checked as far as that is quick."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from service.api.documents import JSON, media_type, parse_document, read_document, refuse_media_type
from service.api.form import FORM, PartRule, ReceivedForm, receive_form
from service.api.identifications.models import IdentificationRequest
from service.api.problems import ProblemError
from service.api.robots.files import keep_inline_robot, read_received_robot, robot_part_rules
from service.api.services import Services
from service.errors import LimitExceededError
from service.jobs import IdentificationOrder, OrderedRecording, Workspace
from service.store import KeptFile, RecordingStore

Role = Literal["recordings", "held_out"]


async def submit_identification(request: Request, services: Services) -> str:
    """Take a request for an identification.

    Parameters
    ----------
    request : Request
        JSON, or a form with the parts request, robot, urdf, recordings and held_out
    services : Services
        where it goes

    Returns
    -------
    str
        the job's identifier

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot is not valid, a recording is not there, or something is too large
    """
    staged = await run_in_threadpool(services.identifications.stage)
    try:
        workspace = Workspace(staged)
        await run_in_threadpool(workspace.prepare)
        received = await _receive(request, services, workspace)
        return await run_in_threadpool(_hand_in, received, services, workspace)
    finally:
        await run_in_threadpool(services.identifications.discard, staged)


@dataclass(frozen=True)
class _Received:
    """A request as it arrived: its document, and the files that came with it."""

    document: IdentificationRequest
    form: ReceivedForm


async def _receive(request: Request, services: Services, workspace: Workspace) -> _Received:
    """Read the body, whichever of the two media types it is."""
    settings = services.settings
    if media_type(request) == JSON:
        return _Received(
            await read_document(request, IdentificationRequest, settings.max_document_bytes), ReceivedForm()
        )
    if media_type(request) != FORM:
        raise refuse_media_type(request, JSON, FORM)
    most = settings.max_recordings
    rules = {
        "request": PartRule(settings.max_document_bytes),
        **robot_part_rules(workspace.robot),
        "recordings": PartRule(settings.max_upload_bytes, workspace.uploads(held_out=False), most),
        "held_out": PartRule(settings.max_upload_bytes, workspace.uploads(held_out=True), most),
    }
    form = await receive_form(request, rules)
    text = form.texts.get("request", b"{}")
    return _Received(parse_document(text, IdentificationRequest, within="part request"), form)


def _hand_in(received: _Received, services: Services, workspace: Workspace) -> str:
    """Check what was received, and queue it."""
    robot_file = _robot_file(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    recordings = _ordered("recordings", received, services.recordings)
    held_out = _ordered("held_out", received, services.recordings)
    _check_roles(recordings, held_out, services.settings.max_recordings)
    order = IdentificationOrder(
        robot_file=robot_file,
        robot_name=robot.name,
        recordings=recordings,
        held_out=held_out,
        options=received.document.options,
    )
    workspace.write_order(order)
    return services.jobs.submit(workspace.folder)


def _robot_file(received: _Received, folder: Path) -> str:
    """Name of the robot file in the job's folder, written there if it came as JSON."""
    file, inline = received.form.file("robot"), received.document.robot
    if file is not None and inline is not None:
        raise ProblemError("invalid-request", "the robot came twice, as part robot and in part request; send it once")
    if file is not None:
        return file.name
    if inline is None:
        raise ProblemError("invalid-request", "no robot was sent; send part robot, or the field robot in the JSON")
    return keep_inline_robot(folder, inline)


def _ordered(role: Role, received: _Received, store: RecordingStore) -> tuple[OrderedRecording, ...]:
    """The recordings of a role: each a file of the form, or else a recording on the server."""
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


def _check_roles(
    recordings: Sequence[OrderedRecording], held_out: Sequence[OrderedRecording], max_recordings: int
) -> None:
    """There is something to identify from, not too much, and no recording is its own judge."""
    if not recordings:
        text = "no recording was sent or named; send part recordings, or name recordings on the server"
        raise ProblemError("invalid-request", text)
    if len(recordings) + len(held_out) > max_recordings:
        count = len(recordings) + len(held_out)
        raise LimitExceededError(f"{count} recordings are more than the {max_recordings} accepted here; send fewer")
    seen: dict[str, str] = {}
    for entry in (*recordings, *held_out):
        if entry.sha256 in seen:
            hint = "a recording counts once, and never judges itself"
            raise ProblemError("invalid-request", f"{seen[entry.sha256]} and {entry.name} hold the same bytes; {hint}")
        seen[entry.sha256] = entry.name
