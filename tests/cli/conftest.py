"""Files that the commands read, made once; what a command prints and how it ends."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from cli.simulated_files import SimulatedFiles, write_files
from tauscope.cli import main


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> SimulatedFiles:
    return write_files(tmp_path_factory.mktemp("simulated"))


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., Ended]:
    """Run the program in this process: ``run("robot", "check", path)``."""

    def runner(*words: str | Path) -> Ended:
        status = main([str(word) for word in words])
        printed = capfd.readouterr()
        return Ended(int(status), printed.out, printed.err)

    return runner
