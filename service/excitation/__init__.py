"""Which motion to ask for: its constraints and criteria, the optimiser that finds it, and what it has found."""

from service.excitation.criteria import Criterion
from service.excitation.design import ExcitationDesign, design_excitation
from service.excitation.design_document import ExcitationDocument, excitation_document
from service.excitation.information import ColumnScaling
from service.excitation.margins import Margins, require_within_limits
from service.excitation.optimiser import OptimiserProgress
from service.excitation.options import ExcitationOptions
from service.excitation.workspace import Box, Workspace

__all__ = [
    "Box",
    "ColumnScaling",
    "Criterion",
    "ExcitationDesign",
    "ExcitationDocument",
    "ExcitationOptions",
    "Margins",
    "OptimiserProgress",
    "Workspace",
    "design_excitation",
    "excitation_document",
    "require_within_limits",
]
