"""Handing an identification in whose recordings lie on the server already."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from tauscope.server.queue.identification_order import IdentificationOptions, IdentificationOrder, OrderedRecording
from tauscope.server.queue.identification_workspace import IdentificationWorkspace
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.store.recordings import RecordingStore


def hand_in_identification(
    jobs: JobQueue,
    kind: JobKind,
    recordings: RecordingStore,
    robot_folder: Path,
    robot: tuple[str, str],
    *,
    train: Sequence[str],
    held_out: Sequence[str],
    options: IdentificationOptions,
) -> str:
    """Hand an identification in.

    Raises
    ------
    NotFoundError
        if a recording does not lie there
    QueueFullError
        if too many jobs are waiting
    """
    staged = kind.items.stage()
    try:
        workspace = IdentificationWorkspace(staged)
        workspace.prepare()
        shutil.copytree(robot_folder, workspace.robot, dirs_exist_ok=True)
        robot_file, robot_name = robot
        workspace.write_order(
            IdentificationOrder(
                robot_file=robot_file,
                robot_name=robot_name,
                recordings=ordered_on_server(recordings, train),
                held_out=ordered_on_server(recordings, held_out),
                options=options,
            )
        )
        return jobs.submit(kind, staged)
    finally:
        kind.items.discard(staged)


def ordered_on_server(recordings: RecordingStore, names: Sequence[str]) -> tuple[OrderedRecording, ...]:
    """Recordings that lie on the server, as an order holds them.

    Raises
    ------
    NotFoundError
        if one does not lie there
    """
    return tuple(OrderedRecording(name=name, origin="server", sha256=recordings.digest(name)) for name in names)
