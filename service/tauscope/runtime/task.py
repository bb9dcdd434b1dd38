"""What a run needs from whoever starts it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from tauscope.recording.journal_rows import JournalHeader
from tauscope.robot import Robot
from tauscope.runtime.drivers import Connection
from tauscope.runtime.options import RunOptions
from tauscope.runtime.progress import Report
from tauscope.runtime.record import RunRecord
from tauscope.runtime.recorder import Recorder
from tauscope.runtime.stop_request import Stops
from tauscope.trajectory import Trajectory

OpenRecorder = Callable[[Path, JournalHeader, Stops, bool], Recorder]
"""Opens a journal: its path, its header, requests to stop, and whether the arm runs in real time."""


class Keeper(Protocol):
    """Takes a run's record whenever it changes."""

    def keep(self, record: RunRecord) -> None:
        """Keep the newest record; must not take time."""
        ...


@dataclass(frozen=True, eq=False)
class RunTask:
    """What is to be run."""

    robot: Robot
    trajectory: Trajectory
    options: RunOptions
    connect: Callable[[], Connection]


@dataclass(frozen=True)
class Surroundings:
    """What a run talks to while it runs."""

    folder: Path
    stops: Stops
    keeper: Keeper
    open_recorder: OpenRecorder
    report: Report
