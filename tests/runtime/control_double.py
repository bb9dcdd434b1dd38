"""A control process over a stand-in for an arm in real time; what shall go wrong stands in the backend's settings."""

import os
import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # run as a program, it finds the other doubles

from runtime.doubles import PointArm, VirtualClock
from tauscope.recording.journal_rows import JournalHeader
from tauscope.robot import Robot
from tauscope.runtime import recorder as recorder_module
from tauscope.runtime.control import control
from tauscope.runtime.drivers import Connection
from tauscope.runtime.recorder import Recorder, RecorderProcess
from tauscope.runtime.run import open_recorder
from tauscope.runtime.states import Stops
from tauscope_drivers import MonotonicClock


class RealClock(VirtualClock):
    """The machine's clock behind the double's."""

    def __init__(self) -> None:
        super().__init__()
        self._clock = MonotonicClock()

    def now_ns(self) -> int:
        return self._clock.now_ns()

    def wait_until_ns(self, deadline_ns: int) -> int:
        return self._clock.wait_until_ns(deadline_ns)


def double(name: str, robot: Robot, settings: Mapping[str, Any], *, folder: Path | None = None) -> Connection:
    """Keys: `block` and `crash` name calls; `slow` maps calls to seconds; `virtual` keeps virtual time."""
    del name, robot, folder
    virtual = bool(settings.get("virtual"))
    arm = PointArm(position=np.array([0.2, 0.1]), clock=VirtualClock() if virtual else RealClock())
    if "block" in settings:
        arm.fail[settings["block"]] = block_for_good
    for call, seconds in settings.get("slow", {}).items():
        arm.fail[call] = partial(time.sleep, seconds)
    if "crash" in settings:
        arm.fail[settings["crash"]] = lambda: os._exit(9)
    return Connection(arm, is_real_time=not virtual)


def block_for_good() -> None:
    while True:
        time.sleep(3600)


def stuck_recorder(path: Path, header: JournalHeader, stops: Stops, is_real_time: bool) -> Recorder:
    """A writer whose disk takes nothing: it opens nothing, and reads nothing from its pipe."""
    del stops, is_real_time
    recorder_module.PIPE_BYTES, recorder_module.CLOSING_S = 2**16, 0.5
    return RecorderProcess(path, header, command=("sleep", "5"))


if __name__ == "__main__":
    disk = stuck_recorder if os.environ.get("STUCK_DISK") else open_recorder
    sys.exit(control(Path(sys.argv[1]), make=double, recorder=disk))
