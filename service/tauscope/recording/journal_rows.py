"""What is kept of each cycle while an arm moves: one row of fixed size, that a journal and a pipe can carry."""

from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from tauscope.errors import RecordingError

JOURNAL_FORM = "tauscope.journal/1"


class Phase(IntEnum):
    """What the arm was doing in a cycle."""

    RAMP = 0  # on its way to where the motion starts
    MOTION = 1  # the motion that the recording is about


@dataclass(frozen=True)
class JournalHeader:
    """What all rows of a journal have in common."""

    robot: str
    joint_names: tuple[str, ...]
    rate_hz: float  # cycles a second that were asked for [Hz]
    mode: str
    effort_unit: str
    torque_per_effort: tuple[float, ...]
    has_velocity: bool
    epoch_offset_ns: int  # to be added to a row's time to make it nanoseconds since 1970 [ns]

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.joint_names)

    def to_dict(self) -> dict[str, Any]:
        """The header as plain data."""
        return {"form": JOURNAL_FORM, **asdict(self)}

    @staticmethod
    def from_dict(data: Any) -> "JournalHeader":
        """The header of plain data. Raises RecordingError where it is no such header."""
        fields = {key: value for key, value in data.items() if key != "form"} if isinstance(data, dict) else {}
        try:
            header = TypeAdapter(JournalHeader).validate_python(fields)
        except ValidationError as error:
            problem = error.errors()[0]
            place = ".".join(str(part) for part in problem["loc"]) or "form"
            raise RecordingError(
                f"the journal's header is not one of Tauscope's ({place}: {problem['msg']})"
            ) from error
        if len(header.torque_per_effort) != header.joint_count or not header.joint_count:
            raise RecordingError("the journal's header is not Tauscope's (torque_per_effort: wrong length)")
        return header


def journal_row_type(joint_count: int) -> np.dtype[np.void]:
    """The layout of a row; all of it eight-byte numbers, so that rows are plain bytes in a pipe.

    ``time_ns`` instant of the reading by the backend's clock, ``lateness_ns`` of the cycle behind its deadline,
    ``phase`` as in `Phase`, ``period`` index of the excitation period or NaN; one number a joint: measured
    ``position``, ``velocity``, ``effort``, ``temperature``, ``voltage``; ``reference``, ``reference_velocity`` and
    ``command`` (effort, NaN where none was commanded).
    """
    scalars = [("time_ns", "<i8"), ("lateness_ns", "<i8"), ("phase", "<i8"), ("period", "<f8")]
    groups = ("position", "velocity", "effort", "temperature", "voltage", "reference", "reference_velocity", "command")
    return np.dtype([*scalars, *((group, "<f8", (joint_count,)) for group in groups)])
