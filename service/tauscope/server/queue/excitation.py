"""Excitation jobs: what is ordered, what their folder holds, the work, and the motion that comes of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from tauscope.errors import LimitExceededError, NotFoundError, TauscopeError
from tauscope.robot import read_robot
from tauscope.server.queue.record import JobProblem, without_folders
from tauscope.server.queue.task_job import TRAJECTORY, TaskOrder, TaskWorkspace, perform_job
from tauscope.tasks import design_excitation
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.trajectory import parse_trajectory_json, read_trajectory
from tauscope.trajectory.csv_format import write_trajectory_rows

MOST_ROWS = 2_000_000
"""Rows of the longest CSV that is made on request."""


class ExcitationOrder(TaskOrder):
    """Input of an excitation job."""

    task = design_excitation

    form: Literal["tauscope.excitation-order/1"] = Field(
        default="tauscope.excitation-order/1", description="name and version of this form"
    )
    options: ExcitationDesignOptions = Field(
        default=ExcitationDesignOptions(), description="how the motion is designed"
    )


class ExcitationWorkspace(TaskWorkspace[ExcitationOrder]):
    """Files of an excitation job."""

    order_type = ExcitationOrder
    noun = "excitation"
    outputs: ClassVar[Mapping[str, str | None]] = {TRAJECTORY: None, "result.json": "tauscope.excitation/1"}


def run_excitation(folder: Path) -> JobProblem | None:
    """Do an excitation job; returns why there is no result."""
    return perform_job(ExcitationWorkspace(folder), folder)


def write_trajectory_piece(workspace: TaskWorkspace[Any], rate_hz: float, start: int) -> bytes:
    """Rows of the trajectory of an excitation that succeeded, as CSV; empty beyond the last one.

    Raises NotFoundError if the file is missing. Raises ExcitationError if the file was damaged. Raises
    LimitExceededError if the CSV would be too long.

    `rate_hz`: samples a second [Hz].
    """
    try:
        content, order = workspace.trajectory.read_bytes(), workspace.read_order()
    except OSError:
        order = None
    if order is None:
        raise NotFoundError("files of the excitation are missing or damaged; hand it in again")
    trajectory = parse_trajectory_json(content, "trajectory.json", read_robot(workspace.robot / order.robot_file))
    rows = trajectory.duration_s * rate_hz
    if rows > MOST_ROWS:
        hint = "ask for a lower rate, or for the document"
        raise LimitExceededError(f"{rows:.3g} rows are more than the {MOST_ROWS} that are made here; {hint}")
    is_over = start >= trajectory.count_samples(rate_hz)
    return b"" if is_over else write_trajectory_rows(trajectory, rate_hz, start).encode()


def check_trajectory(folder: Path, robot_file: Path) -> None:
    """Read a trajectory that a client sent, as a worker process does it.

    Raises ExcitationError if it is not valid, or was made for an arm of another number of joints.
    """
    (path,) = folder.iterdir()
    try:
        read_trajectory(path, read_robot(robot_file))
    except TauscopeError as error:
        raise type(error)(without_folders(str(error), folder, robot_file.parent)) from None
