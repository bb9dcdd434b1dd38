"""The proof: a set of trials, their figures, and the page that shows them. What `tauscope prove` runs."""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from pathlib import Path

from concealed import sets
from concealed.prove import line
from concealed.publishing.page import write_page
from concealed.real import concealed_sets
from concealed.real.concealed_outcome import UNTOUCHED
from concealed.real.concealed_sets import concealed_tasks
from concealed.real.trials import QUICK, REAL
from concealed.running.kept import Kept, Outcome
from concealed.running.run import commit, run
from concealed.running.workers import workers
from concealed.scoring.rescored import rescored
from concealed.scoring.tables import summary
from tauscope.errors import TauscopeError

QUICK_MINUTES = 6.0
"""After so long the reduced set begins no trial more, and `concealed.running.run.PATIENCE_S` later it gives up what is
not done: all is to end within 8 minutes. Trials that take long begin first."""

QUICK_CONCEALED = 4
"""Trials on real recordings in the reduced set: with the same sets untouched, as many as its time allows."""


def main() -> None:
    """Try a set, and write its page."""
    parser = argparse.ArgumentParser(prog="tauscope prove", description=__doc__)
    parser.add_argument("--full", action="store_true", help="the full set")
    parser.add_argument("--first-seed", type=int, default=sets.REPORTING)
    parser.add_argument("--jobs", type=int, help="trials at the same time; one a core by default")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that makes the trials")
    parser.add_argument("--out", type=Path, default=Path("proof-output"), help="folder for outcomes and page")
    parser.add_argument("--page", type=Path, help="the page; into the folder by default")
    parser.add_argument("--minutes", type=float, help="begin no trial after so long; by default 6 for the reduced set")
    asked = parser.parse_args()
    try:
        prove(asked)
    except (TauscopeError, ValueError, OSError, BrokenExecutor) as error:
        raise SystemExit(f"tauscope prove: {error}; what is kept is not tried again") from error


def prove(asked: argparse.Namespace) -> None:
    """The same, asked for by a command line."""
    kept = Kept(asked.out / "outcomes.jsonl")
    if kept.torn:
        print(f"{kept.path}: the last line was torn and is tried again")
    counts = sets.FULL if asked.full else sets.REDUCED
    state = commit()
    wanted = sets.tasks(counts, asked.first_seed, state)
    real = sets.real_tasks(list(REAL) if asked.full else QUICK, state)
    concealed = concealed_tasks(concealed_sets.FULL if asked.full else QUICK_CONCEALED, asked.first_seed, state)
    untouched = [task for task in concealed if task.series == UNTOUCHED]
    if asked.full and asked.minutes is not None:  # a full set that is cut short is a smaller one of the same mix
        wanted = [*untouched, *sets.mix(wanted, real, [task for task in concealed if task not in untouched])]
    else:
        wanted = sets.long_first([*wanted, *real, *concealed])
    minutes = QUICK_MINUTES if asked.minutes is None and not asked.full else asked.minutes
    until = None if minutes is None else 60.0 * minutes
    with workers(asked.jobs, asked.scheduler) as executor:
        left = run(wanted, kept, executor, _teller(len(wanted)), until=until)
    done = [rescored(each) for each in kept.of({task.key for task in wanted})]
    print(summary(done))
    command = f"tauscope prove{' --full' if asked.full else ''}"
    page = asked.page or asked.out / "proof.md"
    for path in write_page(done, page, command, sum(counts.values())) if done else ():
        print(f"wrote {path}")
    if left:
        print(f"{left} of {len(wanted)} trials are left: run the same command again")


def _teller(count: int) -> Callable[[Outcome], None]:
    """Prints each trial as it ends, and how many have."""
    begin, ended = time.monotonic(), []

    def told(each: Outcome) -> None:
        ended.append(each["series"])
        print(f"[{len(ended)}, {time.monotonic() - begin:.0f} s, of {count}] {line(each)}", flush=True)

    return told


if __name__ == "__main__":
    main()
