"""What an arm can be asked to play: segments of motion, the limits that they keep, and the files that hold them."""

from tauscope.trajectory.files import parse_trajectory_json, read_trajectory, trajectory_json, write_trajectory
from tauscope.trajectory.fourier_series import FourierSeries, MotionSamples
from tauscope.trajectory.limits import MotionLimits, motion_limits
from tauscope.trajectory.segments import FourierSegment, MoveSegment, PathSegment, SampledSegment
from tauscope.trajectory.trajectory import DesignRecord, Trajectory, ramp

__all__ = [
    "DesignRecord",
    "FourierSegment",
    "FourierSeries",
    "MotionLimits",
    "MotionSamples",
    "MoveSegment",
    "PathSegment",
    "SampledSegment",
    "Trajectory",
    "motion_limits",
    "parse_trajectory_json",
    "ramp",
    "read_trajectory",
    "trajectory_json",
    "write_trajectory",
]
