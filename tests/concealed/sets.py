"""The two sets of the proof: how many trials of which series, and in which order."""

from collections.abc import Sequence

from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED
from concealed.real.trials import REAL, data
from concealed.scoring.figures import COMPARED
from concealed.task import REAL as REAL_SERIES
from concealed.task import Task

FULL: dict[str, int] = {
    "sound": 78,
    "sound-sensing": 25,
    "sound-coarse": 8,
    "weak": 40,
    "moderate": 60,
    "strong": 48,
    "pair": 20,
    "triple": 10,
    "form": 48,
    "unknown": 24,
    "aliased": 24,
    "strong-sensing": 28,
    "strong-coarse": 8,
    "constant": 12,
    "event": 14,
    "pair-one-joint": 16,
    "drift-beside": 12,
    "sign": 12,
    "sound-poor": 41,
    "poor": 60,
    "sign-poor": 12,
}
"""Trials of each series by ``tauscope prove --full``: a quarter of all conceal nothing."""

REDUCED: dict[str, int] = {
    "sound": 8,
    "sound-sensing": 3,
    "weak": 4,
    "moderate": 6,
    "strong": 4,
    "pair": 2,
    "triple": 1,
    "form": 4,
    "unknown": 2,
    "aliased": 2,
    "strong-sensing": 3,
    "constant": 2,
    "event": 1,
    "pair-one-joint": 1,
    "drift-beside": 1,
    "sign": 1,
    "sound-poor": 3,
    "poor": 4,
    "sign-poor": 1,
}
"""Trials of each series by ``tauscope prove``: a smaller set of the same mix."""

REPORTING = 1_000_000
"""First seed of reports. Seeds below 10,000 were looked at while the diagnosis was made."""

LONG = frozenset({"aliased", "unknown", REAL_SERIES, CONCEALED, UNTOUCHED})
"""Series whose trials take minutes on a slow machine: a recommended motion is recorded too, nothing that is tried
explains what is there, or a real arm's recordings are long."""


def real_tasks(names: Sequence[str], commit: str) -> list[Task]:
    """Trials on recordings of real arms; none where those are not there."""
    return [Task(REAL_SERIES, 0, name, commit) for name in names if (data() / REAL[name].recordings).is_dir()]


def tasks(counts: dict[str, int], first_seed: int, commit: str) -> list[Task]:
    """All trials of a set, the series mixed evenly: a set that is cut short is a smaller one of the same mix."""
    return mix(
        *(
            [Task(series, first_seed + number, None, commit, series in COMPARED) for number in range(count)]
            for series, count in sorted(counts.items())
        )
    )


def mix(*groups: Sequence[Task]) -> list[Task]:
    """All trials of some groups, of each as large a part before any place."""
    places = [((number + 0.5) / len(group), task) for group in groups for number, task in enumerate(group)]
    return [task for _, task in sorted(places, key=lambda each: each[0])]


def long_first(tasks: Sequence[Task]) -> list[Task]:
    """The same trials, otherwise in their order: what begins last ends soon."""
    return sorted(tasks, key=lambda task: task.series not in LONG)
