"""What takes too long is ended, whatever it waits for, and nobody else's limit is lost."""

import itertools
import signal
import subprocess
import sys
import threading
from collections.abc import Callable

import pytest

from concealed.running import run as running
from concealed.running.time_limit import TimeIsUp, time_limit
from concealed.task import Task

FOR_EVER = "import threading; threading.Event().wait()"


def counts_for_ever() -> None:
    for _ in itertools.count():
        pass


def waits_for_a_process() -> None:
    subprocess.run([sys.executable, "-c", FOR_EVER], check=False)


@pytest.mark.parametrize("endless", [counts_for_ever, waits_for_a_process])
def test_what_takes_too_long_is_ended_though_it_catches_what_fails(endless: Callable[[], None]) -> None:
    def tried() -> None:
        try:
            endless()
        except Exception:
            pytest.fail("the limit was taken for a failure")

    with pytest.raises(TimeIsUp), time_limit(0.05):
        tried()


def test_what_ends_in_time_is_left_alone_and_so_is_the_limit_before() -> None:
    before = signal.getsignal(signal.SIGALRM), signal.getitimer(signal.ITIMER_REAL)[0]
    with time_limit(60.0):
        pass
    assert signal.getsignal(signal.SIGALRM) is before[0]
    assert signal.getitimer(signal.ITIMER_REAL)[0] == pytest.approx(before[1], abs=30.0)


def test_another_thread_than_the_main_one_has_no_limit() -> None:
    passed: list[bool] = []

    def limited() -> None:
        with time_limit(1e-6):
            passed.append(True)

    thread = threading.Thread(target=limited)
    thread.start()
    thread.join()
    assert passed == [True]


def test_a_trial_that_has_not_ended_long_after_the_last_instant_to_begin_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(running, "outcome", lambda task: counts_for_ever())
    monkeypatch.setattr(running, "PATIENCE_S", -59.9)
    assert running.in_time(Task("sound", 1), running.time.time() + 60.0) is None
