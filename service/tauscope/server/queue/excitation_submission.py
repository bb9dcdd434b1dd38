"""Having a motion designed for a robot whose files lie in a folder already."""

import shutil
from pathlib import Path

from tauscope.server.queue.excitation_order import ExcitationDesignOptions, ExcitationOrder
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace
from tauscope.server.queue.queue import JobKind, JobQueue


def hand_in_excitation(
    jobs: JobQueue, kind: JobKind, robot_folder: Path, robot: tuple[str, str], options: ExcitationDesignOptions
) -> str:
    """Hand an excitation in.

    Raises
    ------
    QueueFullError
        if too many jobs are waiting
    """
    staged = kind.items.stage()
    try:
        workspace = ExcitationWorkspace(staged)
        shutil.copytree(robot_folder, workspace.robot)
        robot_file, robot_name = robot
        workspace.write_order(ExcitationOrder(robot_file=robot_file, robot_name=robot_name, options=options))
        return jobs.submit(kind, staged)
    finally:
        kind.items.discard(staged)
