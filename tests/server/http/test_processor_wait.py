"""Work that can wait pauses for a multiple of the time that the event loop waited for a processor."""

import threading
from collections.abc import Iterator

import pytest

from tauscope.server.http import processor_wait
from tauscope.server.http.processor_wait import LONGEST_PAUSE_S, ProcessorWait, read_processor_wait


def test_a_pause_is_a_multiple_of_the_wait_since_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: Iterator[float] = iter((2.0, 2.0, 2.01, 2.51))
    monkeypatch.setattr(processor_wait, "read_processor_wait", lambda: next(waits))
    wait = ProcessorWait()
    assert [wait.take_pause() for _ in range(3)] == pytest.approx([0.0, 0.03, LONGEST_PAUSE_S])


def test_the_wait_is_of_the_calling_thread_and_grows() -> None:
    """Threads that compute on one processor make each other wait."""
    before = read_processor_wait()
    threads = [threading.Thread(target=sum, args=(range(3_000_000),)) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert read_processor_wait() >= before >= 0.0


def test_a_system_that_does_not_tell_makes_nothing_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise FileNotFoundError("/proc/thread-self/schedstat")

    monkeypatch.setattr("builtins.open", refuse)
    assert read_processor_wait() == 0.0
    assert ProcessorWait().take_pause() == 0.0
