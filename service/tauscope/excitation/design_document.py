"""A designed excitation as a document: what ``excite --json`` writes and the REST API returns."""

import numpy as np

from tauscope.excitation.design import ExcitationDesign
from tauscope.trajectory.document import trajectory_document
from tauscope.trajectory.excitation_document import ExcitationDocument, HistoryPart


def excitation_document(design: ExcitationDesign) -> ExcitationDocument:
    """The document of a designed excitation."""
    trajectory = trajectory_document(design.trajectory)
    return ExcitationDocument(
        robot=trajectory.robot,
        joints=trajectory.joints,
        criterion=design.criterion.value,
        value=design.value,
        condition_number=design.condition_number,
        random_value=design.random_value,
        period_s=design.series.period_s,
        harmonics=design.series.harmonics,
        periods=design.periods,
        duration_s=design.trajectory.duration_s,
        margins={kind: list(values) for kind, values in design.margins.as_table().items()},
        clearance_m=design.margins.workspace_m,
        active=list(design.active),
        notes=list(design.notes),
        evaluations=design.evaluations,
        seconds=design.seconds,
        history=[
            HistoryPart(start=start, iteration=iteration, value=value, violation=violation)
            for start, iteration, value, violation in design.history
            if np.isfinite(value)
        ],
        trajectory=trajectory,
    )
