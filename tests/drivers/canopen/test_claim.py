"""One master at a time on an interface that any number of programs may open."""

import os
import subprocess
import sys
from uuid import uuid4

import pytest

from tauscope_drivers.canopen.interfaces import BusClaim, ClaimedError


def test_the_second_is_refused_by_the_name_of_the_first_until_that_lets_go() -> None:
    interface = f"can-{uuid4().hex[:8]}"
    first = BusClaim(interface)
    with pytest.raises(ClaimedError, match=rf"process {os.getpid()} \(.+\)"):
        BusClaim(interface)
    BusClaim(interface + "x").release()
    first.release()
    BusClaim(interface).release()


def test_a_process_that_was_killed_holds_nothing() -> None:
    interface = f"can-{uuid4().hex[:8]}"
    code = (
        f"from tauscope_drivers.canopen.interfaces import BusClaim; claim = BusClaim({interface!r}); "
        "print('held', flush=True); input()"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(ClaimedError, match=f"process {other.pid} "):
            BusClaim(interface)
        other.kill()
        other.wait()
        BusClaim(interface).release()
