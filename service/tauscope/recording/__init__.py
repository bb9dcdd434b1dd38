"""What was measured: recordings read, checked, converted and conditioned."""

from tauscope.recording.checks import RecordingReport, check_recording, report_recording
from tauscope.recording.convert import Conversion, convert_recording, write_recording
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import EffortKind, Recording, Samples

__all__ = [
    "Conversion",
    "EffortKind",
    "Recording",
    "RecordingReport",
    "Samples",
    "check_recording",
    "convert_recording",
    "read_recording",
    "report_recording",
    "write_recording",
]
