"""From a request to a run: what was sent is written into the run's folder and checked as far as that is quick."""

import asyncio
import shutil
from dataclasses import dataclass

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from tauscope.errors import ExcitationError
from tauscope.robot import Robot
from tauscope.runtime.options import RunOptions
from tauscope.server.control.leases import Permit
from tauscope.server.control.motions import DesignedMotion, Motion, ready_motion, take_trajectory
from tauscope.server.control.run_order import BackendChoice, RunRequestRecord
from tauscope.server.control.run_workspace import RunWorkspace
from tauscope.server.http.backends import chosen_backend
from tauscope.server.http.documents import to_json_text
from tauscope.server.http.excitations.status import finished_excitation
from tauscope.server.http.form import PartRule
from tauscope.server.http.jobs.submission import Received, keep_robot, receive_request
from tauscope.server.http.leases.router import permit_of
from tauscope.server.http.robots.files import read_received_robot
from tauscope.server.http.runs.models import RunRequest
from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError
from tauscope.server.queue.excitation_order import ExcitationDesignOptions
from tauscope.server.queue.excitation_submission import hand_in_excitation
from tauscope.server.queue.excitation_work import check_trajectory

LARGEST_TRAJECTORY = 64 * 2**20
"""Bytes of the largest trajectory file that is accepted."""


async def submit_run(request: Request, services: Services) -> str:
    """Take a request for a run.

    Raises
    ------
    ProblemError
        if the request is not as documented
    TauscopeError
        if the robot or the motion is not valid, somebody else has the arm, or the lease does not let it move
    """
    items = services.runs.items
    staged = await run_in_threadpool(items.stage)
    try:
        workspace = RunWorkspace(staged)
        await run_in_threadpool(workspace.prepare)
        most = min(LARGEST_TRAJECTORY, services.settings.max_upload_bytes)
        parts = {"trajectory": PartRule(most, workspace.trajectories, default_name="trajectory.json")}
        received = await receive_request(request, RunRequest, services.settings, workspace.robot, parts)
        wanted = await run_in_threadpool(_prepare, received, services, workspace)
        permit = permit_of(request, services, wanted.backend.device(wanted.robot.name))
        if wanted.uploaded:
            checked = services.checks.submit(
                check_trajectory, workspace.trajectories, workspace.robot / wanted.robot_file
            )
            await asyncio.wrap_future(checked)
        return await run_in_threadpool(_hand_in, wanted, services, workspace, permit)
    finally:
        await run_in_threadpool(items.discard, staged)


@dataclass(frozen=True, eq=False)
class _Wanted:
    """A request whose files are in their places."""

    document: RunRequest
    robot_file: str
    robot: Robot
    backend: BackendChoice
    uploaded: bool


def _prepare(received: Received[RunRequest], services: Services, workspace: RunWorkspace) -> _Wanted:
    """Put robot and trajectory into their places, and check the robot."""
    document, has_robot = received.document, received.form.file("robot") or received.document.robot
    if document.excitation is not None and not has_robot:
        excitation = finished_excitation(services, document.excitation)
        order = excitation.read_order()
        shutil.copytree(excitation.robot, workspace.robot, dirs_exist_ok=True)
        robot_file = "robot.yaml" if order is None else order.robot_file
    else:
        robot_file = keep_robot(received, workspace.robot)
    robot = read_received_robot(workspace.robot, robot_file)
    uploaded = received.form.file("trajectory") is not None
    if document.trajectory is not None:
        if uploaded:
            raise ProblemError("invalid-request", "the trajectory came twice, as a part and in part request; send one")
        text = to_json_text(document.trajectory)
        if text is None:
            raise ExcitationError("trajectory: holds NaN, infinity or text that is not Unicode; write plain numbers")
        (workspace.trajectories / "trajectory.json").write_text(text, encoding="utf-8")
        uploaded = True
    if uploaded and document.excitation is not None:
        raise ProblemError("invalid-request", "excitation and trajectory were both given; give one motion")
    backend = chosen_backend(services.settings, document.backend, robot)
    return _Wanted(document, robot_file, robot, backend, uploaded)


def _hand_in(wanted: _Wanted, services: Services, workspace: RunWorkspace, permit: Permit) -> str:
    """Settle what is moved, and how, and begin."""
    document, backend = wanted.document, wanted.backend
    device = backend.device(wanted.robot.name)
    services.runs.claims.require_free(device)
    excitation, motion = _motion(wanted, services, workspace)
    workspace.write_request(
        RunRequestRecord(
            robot_file=wanted.robot_file,
            robot_name=wanted.robot.name,
            backend=backend,
            device=device,
            excitation=excitation,
            options=RunOptions.model_validate(document.model_dump(include=set(RunOptions.model_fields))),
        )
    )
    try:
        return services.runs.submit(workspace.folder, motion, permit=permit)
    except BaseException:
        if excitation is not None and document.excitation is None:
            services.jobs.cancel(services.excitations, excitation)
        raise


def _motion(wanted: _Wanted, services: Services, workspace: RunWorkspace) -> tuple[str | None, Motion]:
    """The excitation that is played, if it is one, and how the run gets its trajectory."""
    identifier = wanted.document.excitation
    if wanted.uploaded:
        return None, ready_motion
    if identifier is not None:
        take_trajectory(finished_excitation(services, identifier), workspace)
        return identifier, ready_motion
    robot = (wanted.robot_file, wanted.robot.name)
    identifier = hand_in_excitation(
        services.jobs, services.excitations, workspace.robot, robot, ExcitationDesignOptions()
    )
    return identifier, DesignedMotion(services.jobs, services.excitations, identifier)
