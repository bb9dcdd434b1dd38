"""The service as it is run: a process of its own, a real socket, real workers."""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2

from shared_data import REPOSITORY

PROGRAM = """
import sys
from pathlib import Path
from tauscope.server.http import Settings, serve
serve(Settings(data_folder=Path(sys.argv[1]), port=0, max_upload_bytes=8_000_000), lambda url: print(url, flush=True))
"""


@dataclass(frozen=True)
class Served:
    """A service that runs, and a client of it."""

    process: "subprocess.Popen[str]"
    client: httpx2.Client


@contextmanager
def served(data_folder: Path) -> Iterator[Served]:
    """A service on a data folder; on leaving it is asked to end, and unless it was killed it ends without a word."""
    arguments = [sys.executable, "-c", PROGRAM, str(data_folder)]
    with subprocess.Popen(
        arguments, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().strip()
            assert re.fullmatch(r"http://127\.0\.0\.1:[0-9]+", url)
            with httpx2.Client(base_url=url, timeout=60) as client:
                yield Served(process, client)
        finally:
            process.terminate()
            out, err = process.communicate(timeout=60)
    if process.returncode != -signal.SIGKILL:
        assert (out, err) == ("", ""), f"{out}{err}"
