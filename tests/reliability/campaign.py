"""Faults at random against the service's stores, jobs and index: `python -m reliability.campaign --injections 10000`.

The service lives in a process of its own on a data folder, one life after the other; each begins with looking whether
everything is true that was said before, meets faults, and is killed or ends. A fault counts when it has struck and
what the service shows afterwards was found true.
"""

import argparse
import faulthandler
import json
import os
import random
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from reliability.damage import damage_something
from reliability.ledger import Ledger
from reliability.service_life import KILLED_ANY_TIME, Life, Plan, draw_plan
from tauscope.server.store.database.database import FILE_NAME, Database

LIVES_OF_A_FOLDER = 10
DAMAGED_WHILE_DOWN = "file damaged while down"
LONGEST_LIFE_S = 300.0


class Campaign:
    """Lives on one data folder after the other, until so many faults have struck."""

    def __init__(self, seed: int, keep: Path | None = None) -> None:
        """`keep`: the folder for what is left where a promise was broken."""
        self.counts: Counter[str] = Counter()
        self.lives = 0
        self._seed, self._keep = seed, keep

    def run(self, injections: int) -> None:
        """Raises SystemExit where a promise was broken, with what it takes to see it again."""
        with tempfile.TemporaryDirectory(prefix="tauscope-faults-") as folder:
            begun, data = Path(folder) / "begun", Path(folder) / "data"
            begun.mkdir()
            Database(begun / FILE_NAME).close()
            while self.counts.total() < injections:
                shutil.copytree(begun, data)
                ledger = Ledger()
                for _ in range(LIVES_OF_A_FOLDER):
                    self._live(data, ledger)
                    if self.counts.total() >= injections:
                        break
                shutil.rmtree(data)

    def _live(self, folder: Path, ledger: Ledger) -> None:
        """One life, and what happens before the next."""
        plan = draw_plan(f"{self._seed}-{self.lives}")
        chance = random.Random(f"{plan.seed} between")
        self.lives += 1
        watch = _Watch(plan, ledger, chance)
        status = watch.follow(*_begun(folder, plan, ledger))
        self.counts += watch.met
        if watch.violation is not None or status not in (0, -signal.SIGKILL):
            told = watch.violation or f"the service's process ended with {status}"
            told = f"broken in life {plan.seed} ({plan}):\n{told}\nafter {dict(self.counts)}"
            if self._keep is not None:
                _keep_traces(self._keep, folder, ledger, told)
            raise SystemExit(told)
        ledger.note("over", "")
        if status != 0:
            self.counts[plan.end] += 1
            ledger.note("killed", "")
        if chance.random() < 0.4 and damage_something(folder, ledger, ledger.note, chance):
            self.counts[DAMAGED_WHILE_DOWN] += 1


def _keep_traces(keep: Path, folder: Path, ledger: Ledger, told: str) -> None:
    """The data folder as it is and all that was noted of it: lives that are killed never go the same way twice."""
    shutil.copytree(folder, keep / "data")
    events = "".join(json.dumps(event) + "\n" for event in ledger.events)
    (keep / "events.jsonl").write_text(events, encoding="utf-8")
    (keep / "broken.txt").write_text(told + "\n", encoding="utf-8")


class _Watch:
    """Listens to a life, and kills it where that is planned."""

    def __init__(self, plan: Plan, ledger: Ledger, chance: random.Random) -> None:
        self.met: Counter[str] = Counter()
        self.violation: str | None = None
        self._ledger, self._chance = ledger, chance
        self._until = LONGEST_LIFE_S
        if plan.end == KILLED_ANY_TIME and chance.random() < 0.4:
            self._until = chance.uniform(0.0, 0.5)
        self._begin = time.monotonic()

    def follow(self, pid: int, pipe: int) -> int:
        """Listen to the end; how the process ended."""
        rest = b""
        while piece := self._piece(pid, pipe):
            *lines, rest = (rest + piece).split(b"\n")
            for line in lines:
                self._take(*json.loads(line))
        os.close(pipe)
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

    def _piece(self, pid: int, pipe: int) -> bytes:
        """What is told next; nothing once all processes of the service are gone."""
        left = max(0.0, self._until - (time.monotonic() - self._begin))
        if not select.select([pipe], [], [], left)[0]:
            if self._until == LONGEST_LIFE_S:
                self.violation = "the service hung where its threads stand above"
                os.kill(pid, signal.SIGUSR1)
                time.sleep(1.0)
            os.kill(pid, signal.SIGKILL)
        return os.read(pipe, 2**16)

    def _take(self, what: str, key: str, value: str) -> None:
        """Something was told."""
        if what == "violation":
            self.violation = key
        elif what == "met":
            self.met[key] += 1
        elif what != "last":
            self._ledger.note(what, key, value)
        elif key == KILLED_ANY_TIME:
            self._until = time.monotonic() - self._begin + self._chance.uniform(0.0, 0.15)


def _begun(folder: Path, plan: Plan, ledger: Ledger) -> tuple[int, int]:
    """The process of a life, and the pipe on which it tells what happens."""
    ours, its = os.pipe()
    pid = os.fork()
    if pid != 0:
        os.close(its)
        return pid, ours
    os.close(ours)

    def tell(what: str, key: str, value: str = "") -> None:
        os.write(its, json.dumps([what, key, value]).encode() + b"\n")

    def note(what: str, key: str, value: str = "") -> None:
        tell(what, key, value)
        if what not in ("met", "last"):
            ledger.note(what, key, value)

    status = 1
    faulthandler.register(signal.SIGUSR1)  # every thread's stack, to the standard error
    try:
        Life(folder, plan, ledger, note).live()
        status = 0
    except BaseException:
        tell("violation", traceback.format_exc())
    finally:
        os._exit(status)


def main() -> None:
    """Run the campaign, and print what struck how often."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--injections", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="new folder for the traces of a broken promise")
    words = parser.parse_args()
    campaign, begin = Campaign(words.seed, words.keep), time.monotonic()
    campaign.run(words.injections)
    for kind, count in sorted(campaign.counts.items()):
        print(f"{count:6} {kind}")
    seconds, times = time.monotonic() - begin, os.times()
    used = times.user + times.system + times.children_user + times.children_system
    what = f"{campaign.counts.total():6} in {campaign.lives} lives, seed {words.seed}"
    print(f"{what}, {seconds:.0f} s, {used:.0f} s of processor: nothing broken")


if __name__ == "__main__":
    sys.exit(main())
