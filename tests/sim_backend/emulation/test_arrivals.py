"""The instants of what a master sends, also while the emulator is busy."""

import os
import select
import time
from collections.abc import Iterator

import pytest

from tauscope_sim.emulation.emulator import PseudoTerminal
from tauscope_sim.emulation.server import Arrivals

BUSY_S = 0.2
DEADLINE_S = 10.0


class Master:
    """The far end of a pseudo terminal."""

    def __init__(self, path: str) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def send(self, data: bytes) -> None:
        os.write(self._descriptor, data)

    def leave(self) -> None:
        os.close(self._descriptor)


@pytest.fixture
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[PseudoTerminal, str]]:
    path = str(tmp_path_factory.mktemp("arrivals") / "port")
    terminal = PseudoTerminal(path)
    yield terminal, path
    terminal.close()


def received(arrivals: Arrivals, count: int) -> list[tuple[bytes, int]]:
    """Pieces that make up so many bytes."""
    pieces: list[tuple[bytes, int]] = []
    deadline = time.monotonic() + DEADLINE_S
    while sum(len(piece) for piece, _ in pieces) < count:
        assert select.select([arrivals], [], [], deadline - time.monotonic())[0], "nothing comes any more"
        pieces += arrivals.take()[0]
    return pieces


def test_bytes_have_the_instant_at_which_they_came_however_busy_the_emulator_is(
    port: tuple[PseudoTerminal, str],
) -> None:
    terminal, path = port
    with Arrivals(terminal) as arrivals:
        master = Master(path)
        before = time.monotonic_ns()
        master.send(b"sync")
        until = time.monotonic() + BUSY_S
        while time.monotonic() < until:  # holds the interpreter, as a step of the physics does
            pass
        after = time.monotonic_ns()
        pieces = received(arrivals, 4)
        master.leave()
    assert b"".join(piece for piece, _ in pieces) == b"sync"
    assert all(before <= instant < after for _, instant in pieces)


def test_nothing_comes_later_that_is_older_than_what_was_taken(port: tuple[PseudoTerminal, str]) -> None:
    terminal, path = port
    with Arrivals(terminal) as arrivals:
        master = Master(path)
        latest = 0
        for number in range(200):
            master.send(bytes([number]))
            pieces, until = arrivals.take()
            assert all(latest <= instant <= until for _, instant in pieces)
            latest = until
        master.leave()


def test_a_master_that_comes_back_is_heard(port: tuple[PseudoTerminal, str]) -> None:
    terminal, path = port
    with Arrivals(terminal) as arrivals:
        for data in (b"first", b"second"):
            master = Master(path)
            master.send(data)
            assert b"".join(piece for piece, _ in received(arrivals, len(data))) == data
            master.leave()
