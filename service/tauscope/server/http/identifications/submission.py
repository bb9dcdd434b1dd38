"""From a request to a job: what was sent is written into the job's folder and checked as far as that is quick."""

from collections.abc import Sequence
from typing import Any

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from tauscope.errors import LimitExceededError
from tauscope.server.http.form import PartRule
from tauscope.server.http.identifications.models import IdentificationRequest
from tauscope.server.http.jobs.submission import Received, keep_robot, receive_request
from tauscope.server.http.robots.files import read_received_robot
from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError
from tauscope.server.queue.identification_order import IdentificationOrder, OrderedRecording
from tauscope.server.queue.identification_workspace import IdentificationWorkspace
from tauscope.server.store.files import KeptFile
from tauscope.server.store.recordings import RecordingStore

_Received = Received[IdentificationRequest]


async def submit_identification(request: Request, services: Services) -> str:
    """Take a request for an identification.

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot is not valid, a recording is not there, or something is too large
    """
    staged = await run_in_threadpool(services.identifications.items.stage)
    try:
        workspace = IdentificationWorkspace(staged)
        await run_in_threadpool(workspace.prepare)
        settings = services.settings
        most = settings.max_recordings
        uploads = {
            "recordings": PartRule(settings.max_upload_bytes, workspace.uploads(held_out=False), most),
            "held_out": PartRule(settings.max_upload_bytes, workspace.uploads(held_out=True), most),
        }
        received = await receive_request(request, IdentificationRequest, settings, workspace.robot, uploads)
        return await run_in_threadpool(_hand_in, received, services, workspace)
    finally:
        await run_in_threadpool(services.identifications.items.discard, staged)


def _hand_in(received: _Received, services: Services, workspace: IdentificationWorkspace) -> str:
    """Check what was received, and queue it."""
    robot_file = keep_robot(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    recordings = ordered_recordings("recordings", received, services.recordings)
    held_out = ordered_recordings("held_out", received, services.recordings)
    check_roles(recordings, held_out, services.settings.max_recordings)
    order = IdentificationOrder(
        robot_file=robot_file,
        robot_name=robot.name,
        recordings=recordings,
        held_out=held_out,
        options=received.document.options,
    )
    workspace.write_order(order)
    return services.jobs.submit(services.identifications, workspace.folder)


def ordered_recordings(role: str, received: Received[Any], store: RecordingStore) -> tuple[OrderedRecording, ...]:
    """The recordings of a role: each a file of the form, or else a recording on the server.

    Raises
    ------
    ProblemError
        if a file was sent but is not listed
    NotFoundError
        if a recording is neither sent nor on the server
    """
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


def check_roles(
    recordings: Sequence[OrderedRecording], held_out: Sequence[OrderedRecording], max_recordings: int
) -> None:
    """There is something to work on, not too much, and no recording is its own judge.

    Raises
    ------
    ProblemError
        naming the recording
    LimitExceededError
        for too many
    """
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
