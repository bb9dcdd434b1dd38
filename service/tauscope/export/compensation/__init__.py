"""Friction compensation: each joint's coefficients, ready for a controller, in joint torque and in drive units."""

from tauscope.export.compensation.model import (
    CompensationModel,
    JointCompensation,
    JointFriction,
    RecordingSource,
    drive_units,
    to_json,
    to_yaml,
)
from tauscope.export.compensation.source_code import to_c_header, to_python

__all__ = [
    "CompensationModel",
    "JointCompensation",
    "JointFriction",
    "RecordingSource",
    "drive_units",
    "to_c_header",
    "to_json",
    "to_python",
    "to_yaml",
]
