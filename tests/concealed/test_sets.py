"""The sets of the proof: as large and as mixed as they claim to be."""

from collections import Counter

import pytest

from concealed import sets
from concealed.generator.case import ARMS, DRY_ARMS, SERIES, drawn
from tauscope.cli import prove_command

SOUND = [series for series, told in SERIES.items() if not told.count]


def sound_share(counts: dict[str, int]) -> float:
    return sum(counts.get(series, 0) for series in SOUND) / sum(counts.values())


def test_the_full_set_is_what_the_proof_asks_for() -> None:
    assert sum(sets.FULL.values()) >= 400
    assert sound_share(sets.FULL) == pytest.approx(0.25, abs=0.01)
    assert set(sets.FULL) == set(SERIES)
    cases = [drawn(task.series, task.seed) for task in sets.tasks(sets.FULL, sets.REPORTING, "")]
    assert {case.arm for case in cases} == {*ARMS, *DRY_ARMS}
    assert {8.0, 15.0, 40.0} <= {case.wanted for case in cases}


def test_the_reduced_set_has_the_same_mix() -> None:
    assert sound_share(sets.REDUCED) == pytest.approx(0.25, abs=0.03)
    assert set(sets.REDUCED) >= {series for series in SERIES if not series.endswith("-coarse")}


def test_a_set_that_is_cut_short_is_a_smaller_one_of_the_same_mix() -> None:
    tasks = sets.tasks(sets.FULL, 0, "")
    assert len({task.key for task in tasks}) == len(tasks)
    first = Counter(task.series for task in tasks[: len(tasks) // 4])
    for series, count in sets.FULL.items():
        assert abs(first[series] - count / 4) <= 1.0


def test_what_takes_long_begins_first() -> None:
    tasks = sets.tasks(sets.REDUCED, 0, "")
    ordered = sets.long_first(tasks)
    count = sum(sets.REDUCED[series] for series in sets.LONG & set(sets.REDUCED))
    assert count > 0
    assert {task.series for task in ordered[:count]} <= sets.LONG
    assert ordered[count:] == [task for task in tasks if task.series not in sets.LONG]


def test_reports_begin_at_seeds_that_nobody_has_looked_at() -> None:
    assert sets.REPORTING >= 1_000_000
    assert prove_command.REPORTING == sets.REPORTING
