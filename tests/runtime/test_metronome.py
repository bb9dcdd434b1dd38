"""Deadlines: absolute, never made up for, and accounted for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.doubles import VirtualClock
from tauscope.runtime.timing import Metronome, lateness_percentiles

PERIOD = 2_000_000


def played(delays: list[int], cycles: int) -> tuple[Metronome, list[tuple[int, int, int]]]:
    """Index, deadline and lateness of every cycle; each wait is as late as the next delay."""
    clock, pending = VirtualClock(), iter(delays)
    clock.delay = lambda deadline: next(pending, 0)
    start = clock.now_ns() + PERIOD
    metronome = Metronome(clock, start, PERIOD, cycles)
    seen = []
    while metronome.wait():
        seen.append((metronome.index, metronome.due_ns - start, metronome.lateness_ns))
    return metronome, seen


def test_on_time() -> None:
    metronome, seen = played([], 5)
    assert seen == [(k, k * PERIOD, 0) for k in range(5)]
    assert metronome.missed == 0


def test_a_little_late_does_not_add_up() -> None:
    _, seen = played([PERIOD // 2] * 5, 5)
    assert [index for index, *_ in seen] == [0, 1, 2, 3, 4]
    assert {late for *_, late in seen} == {PERIOD // 2}


def test_whole_periods_are_left_out_and_never_made_up() -> None:
    metronome, seen = played([0, 3 * PERIOD + 5, 0, 0], 8)
    assert [index for index, *_ in seen] == [0, 4, 5, 6, 7]
    assert seen[1] == (4, 4 * PERIOD, 3 * PERIOD + 5)
    assert metronome.missed == 3


def test_the_last_cycle_is_always_played() -> None:
    metronome, seen = played([0, 100 * PERIOD], 8)
    assert [index for index, *_ in seen] == [0, 7]
    assert metronome.missed == 6


@given(st.lists(st.integers(0, 7 * PERIOD), max_size=60), st.integers(1, 60))
def test_every_period_is_played_or_missed(delays: list[int], cycles: int) -> None:
    metronome, seen = played(delays, cycles)
    indices = [index for index, *_ in seen]
    assert indices == sorted(set(indices))
    assert indices[-1] == cycles - 1
    assert len(indices) + metronome.missed == cycles
    timing = metronome.timing(np.zeros(2, dtype=np.int64))
    assert timing.cycles + timing.missed_periods == cycles
    assert sum(count for _, count in timing.histogram_us) == timing.cycles


def test_percentiles_and_histogram_against_the_sorted_values() -> None:
    late_us = np.arange(1, 1001, dtype=float)
    assert lateness_percentiles(np.random.default_rng(0).permutation(late_us)) == pytest.approx(
        {"p50": 500.5, "p99": 990.0, "p99.9": 999.0, "max": 1000.0}, abs=0.1
    )
    assert lateness_percentiles(np.zeros(0)) == {}
    metronome, _ = played([9_000, 15_000, 150_000, 1_500_000], 4)
    bins = dict(metronome.timing(np.zeros(1, dtype=np.int64)).histogram_us)
    assert {edge: count for edge, count in bins.items() if count} == {10.0: 1, 20.0: 1, 200.0: 1, 2000.0: 1}
