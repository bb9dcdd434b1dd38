"""A fleet on any executor: every robot once, failures apart, never more in hand than there is room for."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from server.queue.executors import InlineExecutor, ManualExecutor
from tauscope.errors import RecordingError
from tauscope.server.queue.cluster_executor import ClusterUnavailableError
from tauscope.server.queue.fleet import AWAY, LOST, FleetEntry, FleetResult, analyse_fleet, read_manifest
from tauscope.server.queue.worker_pool import WorkerPool

HEADER = "name,robot,recordings,held_out\n"


def entries(count: int) -> Iterator[FleetEntry]:
    for number in range(count):
        yield FleetEntry(number, f"arm{number}", Path("arm.yaml"), (Path("a.csv"),), ())


def succeed(entry: FleetEntry, folder: Path) -> FleetResult:
    return FleetResult(entry, {"verdict": str(entry.row)}, None)


def some_fail(entry: FleetEntry, folder: Path) -> FleetResult:
    if entry.row % 3 == 0:
        raise ZeroDivisionError("a bug\nin two lines")
    return succeed(entry, folder)


def some_kill(entry: FleetEntry, folder: Path) -> FleetResult:
    if entry.row in (2, 5):
        os.kill(os.getpid(), signal.SIGKILL)
    return succeed(entry, folder)


def test_every_robot_once_and_failures_apart() -> None:
    found = list(analyse_fleet(entries(10), some_fail, Path(), InlineExecutor(), 2))
    assert sorted(result.entry.row for result in found) == list(range(10))
    assert {result.entry.row for result in found if result.error} == {0, 3, 6, 9}
    assert {result.error for result in found if result.error} == {
        "a fault of Tauscope's own (ZeroDivisionError: a bug in two lines)"
    }


def test_what_is_in_hand_does_not_grow_with_the_fleet() -> None:
    executor, read = ManualExecutor(), []

    def watched() -> Iterator[FleetEntry]:
        for entry in entries(500):
            read.append(entry.row)
            if len(read) >= 8:  # there is no more room: one has to end before the next is read
                executor.run()
            yield entry

    most = 0
    for number, _ in enumerate(analyse_fleet(watched(), succeed, Path(), executor, 4), start=1):
        most = max(most, len(read) - number)
        if len(read) == 500 and executor.tasks:
            executor.run()
    assert len(read) == 500
    assert most <= 8


def test_those_that_were_in_a_pool_that_broke_are_done_again_one_by_one() -> None:
    class BreakingOnce(InlineExecutor):
        """Loses the first four tasks that it is given."""

        lost = 0

        def submit(self, fn, /, *args, **kwargs):
            if self.lost < 4:
                self.lost += 1
                future: Future[FleetResult] = Future()
                future.set_exception(BrokenProcessPool("killed"))
                return future
            return super().submit(fn, *args, **kwargs)

    found = list(analyse_fleet(entries(9), succeed, Path(), BreakingOnce(), 2))
    assert sorted(result.entry.row for result in found) == list(range(9))
    assert [result for result in found if result.error] == []


@pytest.mark.parametrize(("most", "error"), [(5, None), (10**6, AWAY)], ids=["comes back", "stays away"])
def test_a_cluster_that_is_away_loses_no_row(most: int, error: str | None) -> None:
    class Away(InlineExecutor):
        """Takes nothing for a while, or ever."""

        refused = 0

        def submit(self, fn, /, *args, **kwargs):
            if self.refused < most:
                self.refused += 1
                raise ClusterUnavailableError("the scheduler is gone")
            return super().submit(fn, *args, **kwargs)

    found = list(analyse_fleet(entries(9), succeed, Path(), Away(), 2))
    assert sorted(result.entry.row for result in found) == list(range(9))
    assert {result.error for result in found} == {error}


@pytest.mark.slow
def test_a_robot_that_kills_its_worker_is_to_blame_alone() -> None:
    pool = WorkerPool(2)
    found = list(analyse_fleet(entries(12), some_kill, Path(), pool, 2))
    pool.shutdown()
    assert sorted(result.entry.row for result in found) == list(range(12))
    assert {result.entry.row: result.error for result in found if result.error} == {2: LOST, 5: LOST}


def test_a_manifest(tmp_path: Path) -> None:
    path = tmp_path / "fleet.csv"
    path.write_text(HEADER + "cell 1,arms/a.yaml,a.csv; b.csv,c.csv\n\ncell 2,/abs/b.yaml,d.csv,\n", encoding="utf-8")
    first, second = read_manifest(path)
    assert (first.name, first.robot) == ("cell 1", tmp_path / "arms" / "a.yaml")
    assert (first.recordings, first.held_out) == ((tmp_path / "a.csv", tmp_path / "b.csv"), (tmp_path / "c.csv",))
    assert (second.row, second.robot, second.held_out) == (4, Path("/abs/b.yaml"), ())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: begins with nothing; write name,robot,recordings,held_out"),
        ("a,b\n", "line 1: begins with a,b"),
        (HEADER + "x,arm.yaml\n", "line 2: has not 4 columns"),
        (HEADER + "x,arm.yaml,a.csv,,\n", "line 2: has not 4 columns"),
        (HEADER + "x,arm.yaml,a.csv,\nx,arm.yaml,b.csv,\n", "line 3: name x is that of line 2 too"),
        (HEADER + "../x,arm.yaml,a.csv,\n", "line 2: name '../x'"),
        (HEADER + "x,arm.yaml,,b.csv\n", "line 2: names no recording"),
        (HEADER + "x,,a.csv,\n", "line 2: names no robot file"),
    ],
)
def test_a_manifest_that_is_not_valid(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "fleet.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError) as raised:
        list(read_manifest(path))
    assert message in str(raised.value)


def test_a_manifest_that_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "fleet.csv").write_bytes(b"\xff\xfe\0")
    with pytest.raises(RecordingError, match="cannot be read"):
        list(read_manifest(tmp_path / "fleet.csv"))
