"""What a run against the clock missed is counted, and nothing is missing unsaid."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from standstill import STANDSTILL_S, MachineStoodStillError
from tauscope.recording.journal_reading import read_journal
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState

MOST_UNKNOWN = 0.01
"""Part of the samples whose instant is not known, up to which a machine has kept time."""


@contextmanager
def against_the_clock(record: RunRecord) -> Iterator[None]:
    """What fails on a machine that has not kept time, by the run's own account, is tried again; never let pass."""
    try:
        yield
    except AssertionError as error:
        timing = record.timing
        if timing is None:
            raise
        unknown, late_ms = max(timing.stale_samples) / timing.cycles, 1e-3 * timing.lateness_us.get("max", 0.0)
        if unknown < MOST_UNKNOWN and late_ms < 1e3 * STANDSTILL_S:
            raise
        account = f"{unknown:.1%} of the samples at unknown instants, the loop late by {late_ms:.0f} ms"
        raise MachineStoodStillError(f"{account}; the test failed: {error}") from error


def require_all_counted(record: RunRecord, folder: Path, rate_hz: float) -> None:
    """The run has ended well at the rate asked for, and every cycle without an answer is in its counts."""
    assert record.state is RunState.FINISHED, record.problem
    assert record.timing is not None
    assert record.ramp_s is not None
    assert record.motion_s is not None
    timing = record.timing
    print(f"achieved {timing.achieved_rate_hz:.1f} Hz, {timing.missed_periods} of {timing.cycles} missed", timing)
    assert timing.rate_hz == pytest.approx(rate_hz), "the bus budget allows it: the rate was not lowered"
    assert timing.cycles + timing.missed_periods == round((record.ramp_s + record.motion_s) * rate_hz)
    rows = read_journal(folder / "journal.mcap").rows
    unanswered = timing.cycles - len(rows)
    for joint, stale in enumerate(timing.stale_samples):
        missed = int(np.isnan(rows["position"][:, joint]).sum())
        # the last reading is judged by nobody any more; a cycle that nobody answered has no row
        assert missed + unanswered - 1 <= stale <= missed + unanswered
