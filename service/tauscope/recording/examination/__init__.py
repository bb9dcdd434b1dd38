"""What a recording cannot be: columns in another unit, and samples that were never measured."""

from tauscope.recording.examination.examine import examine_recording, read_examined
from tauscope.recording.examination.plausibility import require_plausible

__all__ = ["examine_recording", "read_examined", "require_plausible"]
