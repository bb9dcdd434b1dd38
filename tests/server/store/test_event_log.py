"""Logs that grow: numbers that stay, followers that go on where they ended, lines that never mix."""

import errno
import fcntl
import json
import multiprocessing
import resource
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.server.store.event_log import EventLog


@contextmanager
def no_file_beyond(size: int) -> Iterator[None]:
    """As a disk that becomes full in the middle of a write: the system takes what still fits."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture
def log(tmp_path: Path) -> EventLog:
    return EventLog(tmp_path / "events.jsonl")


def contents(log: EventLog, after: int = 0) -> list[tuple[int, object]]:
    return [(event.number, event.content["n"]) for event in log.follow(after).read()]


def test_a_log_that_is_not_there_is_empty(log: EventLog) -> None:
    assert log.follow().read() == []
    assert log.last() is None


def test_numbers_are_those_of_the_lines(log: EventLog) -> None:
    for n in range(3):
        log.append({"n": n, "text": "two\nlines \u2028 ö"})
    assert contents(log) == [(1, 0), (2, 1), (3, 2)]
    assert contents(log, after=2) == [(3, 2)]
    assert contents(log, after=9) == []
    assert log.last() == {"n": 2, "text": "two\nlines \u2028 ö"}


def test_a_follower_gets_every_line_once(log: EventLog) -> None:
    follower = log.follow(after=1)
    log.append({"n": 1})
    assert follower.read() == []
    log.append({"n": 2})
    log.append({"n": 3})
    assert [event.number for event in follower.read()] == [2, 3]
    assert follower.read() == []
    log.append({"n": 4})
    assert [event.number for event in follower.read()] == [4]


def test_a_line_that_is_half_written_is_not_read_before_it_is_whole(log: EventLog) -> None:
    log.append({"n": 1})
    whole = b'{"n": 2}\n'
    follower = log.follow()
    with log.path.open("ab", buffering=0) as file:
        file.write(whole[:4])
        assert [event.number for event in follower.read()] == [1]
        file.write(whole[4:])
    assert [event.number for event in follower.read()] == [2]


@pytest.mark.parametrize("damage", [b'{"n": 2', b"\0\0\0", b"[" * 10_000, b"\xff\xfe", b"3"])
def test_a_torn_line_keeps_its_number_and_spoils_no_other(log: EventLog, damage: bytes) -> None:
    log.append({"n": 1})
    with log.path.open("ab") as file:
        file.write(damage)
    log.append({"n": 3})
    assert contents(log) == [(1, 1), (3, 3)]
    assert contents(log, after=1) == [(3, 3)]
    assert log.last() == {"n": 3}


@pytest.mark.parametrize("value", [float("nan"), object()])
def test_what_is_no_json_is_refused_as_a_whole(log: EventLog, value: object) -> None:
    with pytest.raises((ValueError, TypeError)):
        log.append({"n": value})
    assert not log.path.exists()


@given(content=st.dictionaries(st.text(max_size=5), st.text(max_size=20), max_size=3), cut=st.integers(0, 400))
def test_any_cut_leaves_a_prefix(tmp_path_factory: pytest.TempPathFactory, content: dict[str, str], cut: int) -> None:
    log = EventLog(tmp_path_factory.mktemp("cut") / "events.jsonl")
    for n in range(4):
        log.append({**content, "n": n})
    whole = log.path.read_bytes()
    log.path.write_bytes(whole[:cut])
    numbers = [number for number, _ in contents(log)]
    assert numbers == list(range(1, whole[:cut].count(b"\n") + 1))
    log.append({"n": "next"})
    assert contents(log)[-1][1] == "next"


def append_many(path: Path, name: str) -> None:
    log = EventLog(path)
    for n in range(200):
        log.append({"name": name, "n": n, "filling": "x" * 300})


def test_a_line_that_the_disk_takes_a_part_of_is_an_error_and_can_be_written_again(log: EventLog) -> None:
    log.append({"n": 1})
    with no_file_beyond(log.path.stat().st_size + 5), pytest.raises(OSError, match="part of a line") as raised:
        log.append({"n": 2})
    assert raised.value.errno == errno.ENOSPC
    log.append({"n": 2})
    assert contents(log) == [(1, 1), (3, 2)]


def test_a_line_that_another_process_is_still_writing_is_waited_for(log: EventLog) -> None:
    log.append({"n": 1})
    appending = threading.Thread(target=log.append, args=({"n": 3},))
    with log.path.open("ab", buffering=0) as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        other.write(b'{"n": ')
        appending.start()
        appending.join(0.1)
        assert appending.is_alive()
        other.write(b"2}\n")
    appending.join()
    assert contents(log) == [(1, 1), (2, 2), (3, 3)]


def test_lines_of_several_processes_never_mix(log: EventLog) -> None:
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=append_many, args=(log.path, name)) for name in "ab"]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    lines = [json.loads(line) for line in log.path.read_text(encoding="utf-8").splitlines()]
    for name in "ab":
        assert [line["n"] for line in lines if line["name"] == name] == list(range(200))
    assert [event.number for event in log.follow().read()] == list(range(1, 401))
