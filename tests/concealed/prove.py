"""Try the diagnosis on concealed effects: `PYTHONPATH=tests python -m concealed.prove --help`.

A trial's truth is sealed before the diagnosis, which runs in a process of its own and sees recordings and a robot file;
only then is it opened. Outcomes are kept line by line: what is there is not tried again.
"""

import argparse
from pathlib import Path

from concealed.generator.case import SERIES
from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED
from concealed.real.concealed_sets import concealed_tasks
from concealed.real.judging.concealed_table import concealed_table
from concealed.running.kept import Kept, Outcome
from concealed.running.run import commit, run
from concealed.running.workers import workers
from concealed.scoring.tables import summary
from concealed.task import REAL, Task


def main() -> None:
    """Try some series, and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    series = [*SERIES, CONCEALED]
    parser.add_argument("series", nargs="+", choices=series, metavar="SERIES", help=", ".join(series))
    parser.add_argument("--count", type=int, default=16, help="trials of each series")
    parser.add_argument("--first-seed", type=int, default=0, help="below 10000: development; from a million: reports")
    parser.add_argument("--arm", help="one arm instead of all, or one set of real recordings")
    parser.add_argument("--jobs", type=int, default=2, help="trials at the same time")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that makes the trials")
    parser.add_argument("--out", type=Path, default=Path("outcomes.jsonl"), help="outcomes, one a line")
    parser.add_argument("--oracle", action="store_true", help="compare with a diagnosis that knows the form")
    asked = parser.parse_args()
    kept, state = Kept(asked.out), commit()
    wanted = [
        Task(series, asked.first_seed + number, asked.arm, state, asked.oracle)
        for series in asked.series
        if series in SERIES
        for number in range(asked.count)
    ]
    if CONCEALED in asked.series:
        drawn = {"set_name": asked.arm, "with_oracle": asked.oracle}
        wanted = [*concealed_tasks(asked.count, asked.first_seed, state, **drawn), *wanted]
    with workers(asked.jobs, asked.scheduler) as executor:
        run(wanted, kept, executor, lambda each: print(line(each), flush=True))
    done = kept.of({task.key for task in wanted})
    print(summary([each for each in done if each["series"] in SERIES]))
    print(concealed_table(done))


def line(each: Outcome) -> str:
    """One trial in one line."""
    if "error" in each:
        return f"{each['series']} {each['seed']}: {each['error'][:200]}"
    score, places = each["score"], [f"{what}@{joint + 1}" for what, joint in each["case"]["places"]]
    again = f" -> {each['again']['verdict']} {each['again']['told']}" if "again" in each else ""
    extra = f" ratio {each['oracle_ratio']:.3f}" if "oracle_ratio" in each else ""
    if each["series"] in (REAL, CONCEALED, UNTOUCHED):
        return f"{each['name']} {score['verdict']} {score['told']} {score['seconds']:.0f} s"
    return (
        f"{each['name']} {', '.join(places) or 'sound'} s {score['strength']:.0f} {each['case']['kind']}"
        f" {each['case']['sensors'] or ''}: {'named' if score['named'] else 'MISSED' if places else ''}"
        f" {score['verdict']} {score['told']}{again}{extra} {score['seconds']:.0f} s"
    )


if __name__ == "__main__":
    main()
