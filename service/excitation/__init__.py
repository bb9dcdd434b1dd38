"""Which motion to ask for: Fourier series, their constraints and criteria, the optimiser, and trajectory files."""

from service.excitation.criteria import Criterion
from service.excitation.design import ExcitationDesign, design_excitation
from service.excitation.design_document import ExcitationDocument, excitation_document
from service.excitation.fourier_series import FourierSeries, MotionSamples
from service.excitation.information import ColumnScaling
from service.excitation.limits import MotionLimits, motion_limits
from service.excitation.margins import Margins, require_within_limits
from service.excitation.optimiser import OptimiserProgress
from service.excitation.options import ExcitationOptions
from service.excitation.segments import FourierSegment, MoveSegment, PathSegment, SampledSegment, Segment
from service.excitation.trajectory import DesignRecord, Trajectory, TrajectorySamples, ramp
from service.excitation.trajectory_files import (
    parse_trajectory_json,
    read_trajectory,
    trajectory_json,
    write_trajectory,
)
from service.excitation.workspace import Box, Workspace

__all__ = [
    "Box",
    "ColumnScaling",
    "Criterion",
    "DesignRecord",
    "ExcitationDesign",
    "ExcitationDocument",
    "ExcitationOptions",
    "FourierSegment",
    "FourierSeries",
    "Margins",
    "MotionLimits",
    "MotionSamples",
    "MoveSegment",
    "OptimiserProgress",
    "PathSegment",
    "SampledSegment",
    "Segment",
    "Trajectory",
    "TrajectorySamples",
    "Workspace",
    "design_excitation",
    "excitation_document",
    "motion_limits",
    "parse_trajectory_json",
    "ramp",
    "read_trajectory",
    "require_within_limits",
    "trajectory_json",
    "write_trajectory",
]
