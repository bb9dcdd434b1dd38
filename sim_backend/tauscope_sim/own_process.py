"""What processes of this tree need to find it, to leave the cores to others, and not to wait for them."""

import contextlib
import gc
import os
from pathlib import Path

PRIORITY = -10  # nice level that a device's process asks for

_TREE = Path(__file__).resolve().parents[1]


def process_environment() -> dict[str, str]:
    """Environment of a Python process that imports this tree."""
    path = os.pathsep.join(filter(None, [str(_TREE), os.environ.get("PYTHONPATH")]))
    # One thread: the matrices are small, and the control loop needs the other cores.
    return {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def take_precedence() -> None:
    """Ask to be put before other programs, as a real arm never has to wait for them; not granted to every user.

    Nor does it wait for Python's garbage collector. No real-time priority: what carries bytes through a pseudo terminal
    is a thread of the kernel without one, and would have to wait.
    """
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, PRIORITY)
    # a session has its own share of the processor where the kernel groups processes by session
    with contextlib.suppress(OSError):
        Path("/proc/self/autogroup").write_text(str(PRIORITY), encoding="ascii")
    gc.collect()
    gc.freeze()
