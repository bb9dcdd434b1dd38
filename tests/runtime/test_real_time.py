"""How the loop's process is scheduled, as far as the system permits it."""

import os
import subprocess
import sys
import threading

from tauscope.runtime.record import child_environment
from tauscope.runtime.timing import BESIDE, PRIORITY, real_time


def test_the_loop_is_above_the_other_threads_of_its_process_and_all_are_put_back() -> None:
    """In a process of its own: real time locks all memory, which is much where many tests ran before."""
    done = subprocess.run(
        [sys.executable, __file__], env=child_environment(), check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


def check() -> None:
    """A thread that holds the interpreter's lock must not wait for another program's real-time thread."""
    ended = threading.Event()
    beside = threading.Thread(target=ended.wait)
    beside.start()
    try:
        assert beside.native_id is not None
        with real_time() as granted:
            if not granted.scheduler.startswith("fifo"):
                assert "refused" in granted.scheduler
                return
            assert os.sched_getscheduler(0) & os.SCHED_FIFO
            assert os.sched_getparam(0).sched_priority == PRIORITY
            assert os.sched_getparam(beside.native_id).sched_priority == PRIORITY - BESIDE
        policies = {os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK for thread in (0, beside.native_id)}
        assert policies == {os.SCHED_OTHER}
    finally:
        ended.set()
        beside.join()


if __name__ == "__main__":
    check()
