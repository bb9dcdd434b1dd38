"""Which motion to ask for: its constraints and criteria, the optimiser that finds it, and what it has found."""

from tauscope.excitation.design import ExcitationDesign, design_excitation, excitation_document
from tauscope.excitation.information import ColumnScaling, Criterion
from tauscope.excitation.margins import require_within_limits
from tauscope.excitation.optimiser import OptimiserProgress
from tauscope.excitation.setting import ExcitationOptions
from tauscope.excitation.workspace import Box, Workspace

__all__ = [
    "Box",
    "ColumnScaling",
    "Criterion",
    "ExcitationDesign",
    "ExcitationOptions",
    "OptimiserProgress",
    "Workspace",
    "design_excitation",
    "excitation_document",
    "require_within_limits",
]
