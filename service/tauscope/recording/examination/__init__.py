"""Columns in another unit, and samples that were never measured: refused, masked or repaired."""

from tauscope.recording.examination.examine import (
    examine_recording,
    find_missing_effort,
    mend_recording,
    open_recording,
)
from tauscope.recording.examination.plausibility import find_implausible

__all__ = ["examine_recording", "find_implausible", "find_missing_effort", "mend_recording", "open_recording"]
