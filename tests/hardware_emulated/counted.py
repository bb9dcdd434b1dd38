"""What a run against the clock missed is counted, and nothing is missing unsaid."""

from pathlib import Path

import numpy as np
import pytest

from service.acquisition import RunRecord, RunState
from service.recording.journal_reading import read_journal


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
