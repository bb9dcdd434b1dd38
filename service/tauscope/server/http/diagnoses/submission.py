"""From a request to a job: what was sent is written into the job's folder and checked as far as that is quick."""

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.diagnoses.models import DiagnosisRequest
from tauscope.server.http.form import PartRule
from tauscope.server.http.identifications.submission import check_roles, ordered_recordings
from tauscope.server.http.jobs.submission import Received, keep_robot, receive_request
from tauscope.server.http.robots.files import read_received_robot
from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError
from tauscope.server.queue.diagnosis_order import DiagnosisOrder
from tauscope.server.queue.diagnosis_workspace import ROLES as DIAGNOSIS_ROLES
from tauscope.server.queue.diagnosis_workspace import DiagnosisWorkspace


async def submit_diagnosis(request: Request, services: Services) -> str:
    """Take a request for a diagnosis.

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot is not valid, a recording is not there, or something is too large
    """
    staged = await run_in_threadpool(services.diagnoses.items.stage)
    try:
        workspace = DiagnosisWorkspace(staged)
        await run_in_threadpool(workspace.prepare)
        settings = services.settings
        uploads = {
            role: PartRule(settings.max_upload_bytes, workspace.uploads(role), settings.max_recordings)
            for role in DIAGNOSIS_ROLES
        }
        received = await receive_request(request, DiagnosisRequest, settings, workspace.robot, uploads)
        return await run_in_threadpool(_hand_in, received, services, workspace)
    finally:
        await run_in_threadpool(services.diagnoses.items.discard, staged)


def _hand_in(received: Received[DiagnosisRequest], services: Services, workspace: DiagnosisWorkspace) -> str:
    """Check what was received, and queue it."""
    robot_file = keep_robot(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    recordings, held_out, simulated = (
        ordered_recordings(role, received, services.recordings) for role in DIAGNOSIS_ROLES
    )
    check_roles(recordings, (*held_out, *simulated), services.settings.max_recordings)
    options = received.document.options
    if (options.against == "simulation") != bool(simulated):
        text = "options.against: simulation and recordings of a simulator belong together; send both or neither"
        raise ProblemError("invalid-request", text)
    order = DiagnosisOrder(
        robot_file=robot_file,
        robot_name=robot.name,
        recordings=recordings,
        held_out=held_out,
        simulated=simulated,
        options=options,
    )
    workspace.write_order(order)
    return services.jobs.submit(services.diagnoses, workspace.folder)
