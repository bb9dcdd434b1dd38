"""From a request to a campaign."""

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from tauscope.server.control.campaign_order import CampaignOrder
from tauscope.server.control.campaign_workspace import CampaignWorkspace
from tauscope.server.http.backends import chosen_backend
from tauscope.server.http.campaigns.models import CampaignRequest
from tauscope.server.http.jobs.submission import Received, keep_robot, receive_request
from tauscope.server.http.leases.router import permit_of
from tauscope.server.http.robots.files import read_received_robot
from tauscope.server.http.services import Services


async def submit_campaign(request: Request, services: Services) -> str:
    """Take a request for a campaign.

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot is not valid, somebody else has the arm, or the lease does not let it move
    """
    items = services.campaigns.items
    staged = await run_in_threadpool(items.stage)
    try:
        workspace = CampaignWorkspace(staged)
        await run_in_threadpool(workspace.prepare)
        received = await receive_request(request, CampaignRequest, services.settings, workspace.robot)
        return await run_in_threadpool(_hand_in, received, services, workspace, request)
    finally:
        await run_in_threadpool(items.discard, staged)


def _hand_in(
    received: Received[CampaignRequest], services: Services, workspace: CampaignWorkspace, request: Request
) -> str:
    """Check what was received, and begin."""
    document, robot_file = received.document, keep_robot(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    backend = chosen_backend(services.settings, document.backend, robot)
    permit = permit_of(request, services, backend.device(robot.name))
    workspace.write_order(
        CampaignOrder(
            robot_file=robot_file,
            robot_name=robot.name,
            backend=backend,
            excitation=document.excitation,
            held_out=document.held_out,
            run=document.run,
            identification=document.identification,
            diagnosis=document.diagnosis,
        )
    )
    return services.campaigns.submit(workspace.folder, permit)
