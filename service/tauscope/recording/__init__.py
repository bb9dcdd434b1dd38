"""What was measured: recordings read, checked, converted and conditioned."""

from tauscope.recording.checks import RecordingReport, check_recording, report_recording
from tauscope.recording.convert import convert_recording, write_recording
from tauscope.recording.examination.examine import examine_recording, open_recording
from tauscope.recording.layout.guess import flow_text
from tauscope.recording.reading import ColumnMapping, find_mapping, read_recording
from tauscope.recording.recording import EffortKind, Recording, Samples
from tauscope.recording.units import Reading

__all__ = [
    "ColumnMapping",
    "EffortKind",
    "Reading",
    "Recording",
    "RecordingReport",
    "Samples",
    "check_recording",
    "convert_recording",
    "examine_recording",
    "find_mapping",
    "flow_text",
    "open_recording",
    "read_recording",
    "report_recording",
    "write_recording",
]
