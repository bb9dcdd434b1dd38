"""What is kept, and what is done side by side."""

import threading

from tauscope.effects.computation import THREADS, LastFew, side_by_side

WAIT_S = 30.0


def test_the_last_few_are_kept_and_what_nobody_asked_for_goes_first() -> None:
    kept: LastFew[str, str] = LastFew(2)
    made: list[str] = []

    def asked(key: str) -> str:
        def make() -> str:
            made.append(key)
            return key.upper()

        return kept.get(key, make)

    assert [asked(key) for key in "abab"] == ["A", "B", "A", "B"]
    assert made == ["a", "b"]
    asked("a")
    asked("c")
    assert kept.latest == "C"
    assert [asked("a"), asked("b")] == ["A", "B"]
    assert made == ["a", "b", "c", "b"]


def test_nothing_was_asked_for_at_first() -> None:
    assert LastFew(1).latest is None


def test_what_two_threads_ask_for_at_once_is_one_and_the_same_from_then_on() -> None:
    kept: LastFew[int, object] = LastFew(4)
    meeting = threading.Barrier(2, timeout=WAIT_S)

    def make() -> object:
        meeting.wait()
        return object()

    first, second = side_by_side(lambda key: kept.get(key, make), [1, 1])
    assert kept.get(1, object) in (first, second)


def test_items_are_done_at_once_and_come_back_in_their_order() -> None:
    meeting = threading.Barrier(THREADS, timeout=WAIT_S)

    def work(item: int) -> int:
        meeting.wait()
        return 10 * item

    assert side_by_side(work, range(2 * THREADS)) == [10 * item for item in range(2 * THREADS)]


def test_nothing_is_done_of_nothing() -> None:
    assert side_by_side(lambda item: item, []) == []
