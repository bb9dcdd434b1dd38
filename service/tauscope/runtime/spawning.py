"""Processes of our own: started with this very source tree, one computing thread each."""

import os
from pathlib import Path

_THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def child_environment() -> dict[str, str]:
    """Environment of a child process: it imports the modules that this process has, and computes in one thread."""
    source = str(Path(__file__).resolve().parents[2])
    known = os.environ.get("PYTHONPATH")
    threads = dict.fromkeys(_THREAD_SETTINGS, "1")
    return {**os.environ, **threads, "PYTHONPATH": f"{source}{os.pathsep}{known}" if known else source}


def process_start(pid: int) -> int | None:
    """When a process was started, in the kernel's ticks; with its number it names a process for good.

    Returns
    -------
    int or None
        None where there is no such process
    """
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name before it stands in parentheses and may hold anything.
    fields = status.rpartition(")")[2].split()
    return None if fields[0] in "ZX" else int(fields[19])
