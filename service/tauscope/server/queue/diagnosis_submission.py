"""Handing a diagnosis in whose recordings lie on the server already."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from tauscope.server.queue.diagnosis_order import DiagnosisOptions, DiagnosisOrder
from tauscope.server.queue.diagnosis_workspace import DiagnosisWorkspace
from tauscope.server.queue.identification_submission import ordered_on_server
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.store.recordings import RecordingStore


def hand_in_diagnosis(
    jobs: JobQueue,
    kind: JobKind,
    recordings: RecordingStore,
    robot_folder: Path,
    robot: tuple[str, str],
    *,
    train: Sequence[str],
    held_out: Sequence[str],
    options: DiagnosisOptions,
) -> str:
    """Hand a diagnosis in.

    Raises
    ------
    NotFoundError
        if a recording does not lie there
    QueueFullError
        if too many jobs are waiting
    """
    staged = kind.items.stage()
    try:
        workspace = DiagnosisWorkspace(staged)
        workspace.prepare()
        shutil.copytree(robot_folder, workspace.robot, dirs_exist_ok=True)
        order = DiagnosisOrder(
            robot_file=robot[0],
            robot_name=robot[1],
            recordings=ordered_on_server(recordings, train),
            held_out=ordered_on_server(recordings, held_out),
            options=options,
        )
        workspace.write_order(order)
        return jobs.submit(kind, staged)
    finally:
        kind.items.discard(staged)
