"""``tauscope release``: ask whether the arm is supported, let go of it, and say so."""

import sys
from pathlib import Path

import typer

from tauscope.cli.terminal import output, plain
from tauscope.errors import AcquisitionError
from tauscope.robot import read_robot
from tauscope.runtime.drivers import find_bus, select_bus
from tauscope.runtime.release import release


def release_arm(path: Path, backend: str | None, *, is_supported: bool) -> None:
    """Let go of an arm.

    Raises AcquisitionError where nobody states that it is supported, or a drive is not reached or under power still.
    """
    robot = read_robot(path)
    bus = select_bus(robot) if backend is None else find_bus(backend)
    if not is_supported and not _ask(robot.name):
        raise AcquisitionError(f"{robot.name} holds on; support it, then state --supported")
    release(bus.name, robot, {})
    output().print(plain(f"{robot.name}: no drive is under power"), soft_wrap=True)


def _ask(name: str) -> bool:
    """Whether somebody at a terminal says that the arm is supported."""
    return sys.stdin.isatty() and typer.confirm(f"{name} will be without torque. Is it supported?")
