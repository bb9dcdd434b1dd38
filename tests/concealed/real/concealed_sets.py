"""The trials on real recordings, and the untouched sets that they are judged beside: all of them, or a quick sample."""

from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED
from concealed.real.concealing.recorded_sets import CYCLE, SETS, set_of_seed
from concealed.task import Task

FULL = 19 * len(CYCLE)
"""Trials of the full set, 304: every set as often as its share, every kind as often as its rule allows."""

QUICK = len(SETS)
"""Trials of a quick sample: every set once, no kind twice unless its rule refuses another."""


def concealed_tasks(
    count: int, first_seed: int, commit: str, *, set_name: str | None = None, with_oracle: bool = False
) -> list[Task]:
    """Trials of consecutive seeds, after the untouched sets; none on sets that this machine has not."""
    trials = [
        Task(CONCEALED, seed, set_name, commit, with_oracle)
        for seed in range(first_seed, first_seed + count)
        if SETS[set_name or set_of_seed(seed)].is_there
    ]
    sets = dict.fromkeys(each.arm or set_of_seed(each.seed) for each in trials)
    return [*(Task(UNTOUCHED, 0, name, commit) for name in sets), *trials]
