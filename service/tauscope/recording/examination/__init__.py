"""What a recording cannot be: columns in another unit, and samples that were never measured."""

from tauscope.recording.examination.examine import examine_recording, find_missing_effort, read_examined
from tauscope.recording.examination.mending import mend_recording
from tauscope.recording.examination.plausibility import find_implausible

__all__ = ["examine_recording", "find_implausible", "find_missing_effort", "mend_recording", "read_examined"]
