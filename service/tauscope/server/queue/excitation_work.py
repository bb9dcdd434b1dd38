"""The work of an excitation job, as a worker process does it: a robot file in, a motion out."""

import math
from functools import partial
from pathlib import Path

from tauscope.errors import LimitExceededError, TauscopeError
from tauscope.excitation import OptimiserProgress, design_excitation, excitation_document
from tauscope.files import write_atomically
from tauscope.robot import read_robot
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace
from tauscope.server.queue.record import JobProblem, without_folders
from tauscope.server.queue.work import begin_step, do_work, require_wanted
from tauscope.trajectory import parse_trajectory_json, read_trajectory, trajectory_json
from tauscope.trajectory.csv_format import trajectory_csv

MOST_ROWS = 2_000_000
"""Rows of the longest CSV that is made on request."""


def run_excitation(folder: Path) -> JobProblem | None:
    """Do an excitation job.

    Returns
    -------
    JobProblem or None
        why there is no result; None where there is one
    """
    workspace = ExcitationWorkspace(folder)
    return do_work(workspace, partial(_design, workspace), workspace.robot)


def read_designed_trajectory(workspace: ExcitationWorkspace, rate_hz: float | None) -> bytes | None:
    """The trajectory of an excitation that succeeded.

    Parameters
    ----------
    rate_hz : float or None
        samples a second of a CSV [Hz]; None for the exact document

    Returns
    -------
    bytes or None
        content of the file; None where it is missing

    Raises
    ------
    ExcitationError
        if the file was damaged
    LimitExceededError
        if the CSV would be too long
    """
    try:
        content = workspace.trajectory.read_bytes()
        order = workspace.read_order()
    except OSError:
        return None
    if rate_hz is None or order is None:
        return content if order is not None else None
    trajectory = parse_trajectory_json(content, "trajectory.json", read_robot(workspace.robot / order.robot_file))
    rows = trajectory.duration_s * rate_hz
    if rows > MOST_ROWS:
        hint = "ask for a lower rate, or for the document"
        raise LimitExceededError(f"{rows:.3g} rows are more than the {MOST_ROWS} that are made here; {hint}")
    return trajectory_csv(trajectory, rate_hz).encode()


def check_trajectory(folder: Path, robot_file: Path) -> None:
    """Read a trajectory that a client sent, as a worker process does it.

    Raises
    ------
    ExcitationError
        if it is not valid, or was made for an arm of another number of joints
    """
    (path,) = folder.iterdir()
    try:
        read_trajectory(path, read_robot(robot_file))
    except TauscopeError as error:
        raise type(error)(without_folders(str(error), folder, robot_file.parent)) from None


def _design(workspace: ExcitationWorkspace) -> None:
    """Read, design, write."""
    order = workspace.read_order()
    if order is None:
        raise TauscopeError("the job's order.json is missing or damaged; hand the excitation in again")
    begin_step(workspace, "read robot")
    robot = read_robot(workspace.robot / order.robot_file)
    begin_step(workspace, "design the motion")
    design = design_excitation(robot, order.options.to_options(), progress=partial(_tell, workspace))
    begin_step(workspace, "write design and trajectory")
    write_atomically(workspace.trajectory, trajectory_json(design.trajectory).encode())
    content = excitation_document(design).model_dump_json(by_alias=True, indent=1).encode()
    write_atomically(workspace.result, content)


def _tell(workspace: ExcitationWorkspace, progress: OptimiserProgress) -> None:
    """Tell where the optimiser is, unless nobody wants to know any more."""
    require_wanted(workspace)
    figures = {"step": progress.step, "cost": _finite(progress.cost), "best_cost": _finite(progress.best)}
    workspace.write_progress(round(100.0 * progress.fraction, 1), figures)


def _finite(value: float) -> float | None:
    """JSON knows no infinity."""
    return value if math.isfinite(value) else None
