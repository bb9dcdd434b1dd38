"""What an arm can be asked to play: segments of motion, the limits that they keep, and the files that hold them."""

from tauscope.trajectory.files import parse_trajectory_json, read_trajectory, trajectory_json, write_trajectory
from tauscope.trajectory.fourier_series import FourierSeries, MotionSamples
from tauscope.trajectory.limits import MotionLimits, motion_limits
from tauscope.trajectory.segments import FourierSegment, SampledSegment
from tauscope.trajectory.trajectory import Trajectory

__all__ = [
    "FourierSegment",
    "FourierSeries",
    "MotionLimits",
    "MotionSamples",
    "SampledSegment",
    "Trajectory",
    "motion_limits",
    "parse_trajectory_json",
    "read_trajectory",
    "trajectory_json",
    "write_trajectory",
]
