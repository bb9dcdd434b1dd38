"""The hook that asks the cell whether the arm is free: a program that the operator puts into the data folder."""

import stat
import subprocess
from pathlib import Path

from tauscope.robot.messages import one_line

FOLDER = "interlocks"
TIMEOUT_S = 10.0
"""How long the program may take [s]."""


def find_objection(data_folder: Path, name: str, robot: str, device: str) -> str | None:
    """Ask whether an arm is free. Whatever goes wrong with asking counts as no.

    Only programs in the folder are called, never a command that came over the network.

    Returns str or None: one line: why it is not free; None where it is.
    """
    path = data_folder / FOLDER / name
    fault = _fault(path)
    if fault is not None:
        return f"interlock {name}: {fault}"
    try:
        done = subprocess.run(  # noqa: S603 - the operator's own program, without a shell
            [str(path), robot, device],
            capture_output=True,
            timeout=TIMEOUT_S,
            check=False,
            stdin=subprocess.DEVNULL,
            cwd=data_folder,
        )
    except subprocess.TimeoutExpired:
        return f"interlock {name}: did not answer within {TIMEOUT_S:g} s"
    except OSError as error:
        return f"interlock {name}: cannot be called ({error.strerror or error})"
    if done.returncode == 0:
        return None
    said = (done.stdout.strip() or done.stderr.strip()).decode("utf-8", "replace").splitlines()
    return one_line(f"interlock {name}: {said[0] if said else f'exit status {done.returncode}'}")


def _fault(path: Path) -> str | None:
    """Why a program is not called."""
    try:
        status = path.lstat()
    except OSError:
        return f"there is no program {path.name} in the folder {FOLDER} of the data folder"
    if not stat.S_ISREG(status.st_mode) or not status.st_mode & stat.S_IXUSR:
        return "is no program: an executable file, no link, is needed"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others may write to it; take that right away (chmod go-w)"
    return None
