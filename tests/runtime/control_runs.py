"""Runs in control processes, for tests: files of a small arm, and ways to wait that do not guess."""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from runtime.doubles import point_robot, short_motion
from shared_data import REPOSITORY
from tauscope.robot import read_robot
from tauscope.runtime.options import BackendOrder, RunOrder
from tauscope.runtime.record import RunRecord, read_record
from tauscope.runtime.run_process import RunProcess
from tauscope.trajectory import write_trajectory

ROBOT = """\
name: points
kinematics:
  dh:
    - {theta: 0.0, d: 0.1, a: 0.0, alpha: 0.0}
    - {theta: 0.0, d: 0.1, a: 0.0, alpha: 0.0}
joints:
  - {name: joint1, limits: {position: [-2.0, 2.0], velocity: 2.0, acceleration: 10.0, torque: 50}}
  - {name: joint2, limits: {position: [-2.0, 2.0], velocity: 2.0, acceleration: 10.0, torque: 50}}
"""
DOUBLE = (sys.executable, str(REPOSITORY / "tests" / "runtime" / "control_double.py"))
LONG_S = 30.0


class Events(list[dict[str, Any]]):
    """Collects events; can be waited for."""

    def __call__(self, event: Any) -> None:
        self.append(dict(event))

    def states(self) -> list[str]:
        return [event["state"] for event in self if event["event"] == "state"]


def write_order(folder: Path, *, duration_s: float = 2.0, settings: dict | None = None, **options: Any) -> RunOrder:
    """The files of a run of the double, beside its folder, and its order."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    robot_file, motion_file = folder.parent / "points.yaml", folder.parent / f"{folder.name}.json"
    robot_file.write_text(ROBOT, encoding="utf-8")
    motion = short_motion(point_robot(), repeats=round(duration_s / 0.5))
    write_trajectory(motion, motion_file)
    return RunOrder(
        robot=str(robot_file),
        trajectory=str(motion_file),
        backend=BackendOrder(name="double", settings=settings or {}),
        options=options,  # type: ignore[arg-type]
    )


def start(
    folder: Path, *, duration_s: float = 2.0, settings: dict | None = None, **options: Any
) -> tuple[RunProcess, Events]:
    """A run of the double in a control process of its own."""
    order = write_order(folder, duration_s=duration_s, settings=settings, **options)
    events = Events()
    return RunProcess(folder, order, read_robot(Path(order.robot)), report=events, command=DOUBLE), events


def wait_for(condition: Callable[[], bool], what: str, patience_s: float = LONG_S, poll_s: float = 0.005) -> None:
    """Poll until something is so."""
    deadline = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not happen within {patience_s:g} s"
        time.sleep(poll_s)


def states(record: RunRecord) -> list[str]:
    return [transition.state.value for transition in record.history]


def state_of(folder: Path) -> str:
    return read_record(folder).state.value
