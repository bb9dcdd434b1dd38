"""From a request to an excitation job."""

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.excitations.models import ExcitationRequest
from tauscope.server.http.jobs.submission import Received, keep_robot, receive_request
from tauscope.server.http.robots.files import read_received_robot
from tauscope.server.http.services import Services
from tauscope.server.queue.excitation_order import ExcitationOrder
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace


async def submit_excitation(request: Request, services: Services) -> str:
    """Take a request for an excitation.

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot is not valid, or something is too large
    """
    items = services.excitations.items
    staged = await run_in_threadpool(items.stage)
    try:
        workspace = ExcitationWorkspace(staged)
        await run_in_threadpool(workspace.prepare)
        received = await receive_request(request, ExcitationRequest, services.settings, workspace.robot)
        return await run_in_threadpool(_hand_in, received, services, workspace)
    finally:
        await run_in_threadpool(items.discard, staged)


def _hand_in(received: Received[ExcitationRequest], services: Services, workspace: ExcitationWorkspace) -> str:
    """Check what was received, and queue it."""
    robot_file = keep_robot(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    workspace.write_order(
        ExcitationOrder(robot_file=robot_file, robot_name=robot.name, options=received.document.options)
    )
    return services.jobs.submit(services.excitations, workspace.folder)
