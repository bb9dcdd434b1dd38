"""The program's commands as tests call them, and a short motion to run."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tauscope.cli import main
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import read_robot
from tauscope.trajectory import write_trajectory

Tauscope = Callable[..., tuple[int, str, str]]
"""From arguments to exit status, standard output and standard error."""

SHORT = ExcitationOptions(period_s=2.0, periods=1, starts=1, slow_postures=0, closing_period=False)


def called_with(capfd: pytest.CaptureFixture[str]) -> Tauscope:
    """The program, its output taken from where the test's goes."""

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        status = main([str(argument) for argument in arguments])
        seen = capfd.readouterr()
        return int(status), seen.out, seen.err

    return run


def write_short_motion(robot: Path, target: Path) -> None:
    """Two seconds that the arm of a robot file can be asked for."""
    write_trajectory(design_excitation(read_robot(robot), SHORT).trajectory, target)
