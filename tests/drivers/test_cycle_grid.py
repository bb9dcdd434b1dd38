"""When cycles are due, told by when they come."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tauscope_drivers.clock import CycleGrid

CYCLE_NS = 5_000_000


@given(arrays(np.int64, 50, elements=st.integers(0, int(0.85 * CYCLE_NS))))
def test_lateness_is_told_against_the_calls_that_were_the_earliest(late_ns: np.ndarray) -> None:
    late_ns[0] = 0
    grid = CycleGrid(1e-9 * CYCLE_NS)
    for cycle, late in enumerate(late_ns.tolist()):
        now_ns = cycle * CYCLE_NS + late
        assert grid.cycles_until(now_ns) == 1
        assert grid.late_ns(now_ns) == late


def test_a_call_soon_after_a_late_one_belongs_to_its_cycle_and_skipped_ones_are_counted() -> None:
    grid = CycleGrid(1e-9 * CYCLE_NS)
    assert [grid.cycles_until(round(at * CYCLE_NS)) for at in (0.0, 1.8, 2.0, 3.0, 6.0)] == [1, 1, 1, 1, 3]
    assert [grid.cycles_until(round(at * CYCLE_NS)) for at in (6.2, 7.1)] == [0, 1]


def test_an_earlier_call_moves_the_grid_and_a_pause_begins_it_anew() -> None:
    grid = CycleGrid(1e-9 * CYCLE_NS)
    lateness = []
    for at in (0.0, 0.9, 2.1, 40.3, 41.4):
        grid.cycles_until(round(at * CYCLE_NS))
        lateness.append(grid.late_ns(round(at * CYCLE_NS)) / CYCLE_NS)
    np.testing.assert_allclose(lateness, [0.0, 0.0, 0.2, 0.0, 0.1], atol=1e-6)
