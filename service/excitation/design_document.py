"""A designed excitation as a document: what ``excite --json`` writes and the REST API returns."""

from typing import Literal

import numpy as np
from pydantic import Field

from service.excitation.design import ExcitationDesign
from service.trajectory.document import TrajectoryDocument, TrajectoryPart, trajectory_document
from service.trajectory.files import EXCITATION_SCHEMA


class HistoryPart(TrajectoryPart):
    """One iteration of the optimiser."""

    start: int = Field(description="from which start, counted from 1")
    iteration: int = Field(description="of this round, counted from 1")
    value: float = Field(description="criterion as the optimiser saw it, friction's sign smoothed")
    violation: float = Field(description="largest violation of a constraint, as part of the limit; 0: all are kept")


class ExcitationDocument(TrajectoryPart):
    """A designed excitation."""

    schema_: Literal["tauscope.excitation/1"] = Field(
        default=EXCITATION_SCHEMA, alias="schema", description="name and version of this form"
    )
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of the joints, base first")
    criterion: Literal["cond-f", "log-det", "cond-2"] = Field(description="what was minimised")
    value: float = Field(description="the criterion for one period")
    condition_number: float = Field(description="of the stacked, unweighted regressor of one period, SI units")
    random_value: float = Field(description="the criterion of the best random motion that the optimiser began with")
    period_s: float = Field(description="duration of one period [s]")
    harmonics: int = Field(description="number of harmonics")
    periods: int = Field(description="how often the period is repeated")
    duration_s: float = Field(description="duration of the whole trajectory [s]")
    margins: dict[str, list[float | None]] = Field(
        description="part of each kind of limit that is left, one a joint; null where there is no limit"
    )
    clearance_m: float | None = Field(
        description="smallest clearance of joint origins and tool [m]; null where nothing is forbidden"
    )
    active: list[str] = Field(description="limits that keep the criterion from getting better")
    notes: list[str] = Field(description="what was assumed or could not be done")
    evaluations: int = Field(description="motions whose criterion was computed")
    seconds: float = Field(description="time that the optimiser took [s]")
    history: list[HistoryPart] = Field(description="every iteration")
    trajectory: TrajectoryDocument = Field(description="what a run plays, schema tauscope.trajectory/1")


def excitation_document(design: ExcitationDesign) -> ExcitationDocument:
    """The document of a designed excitation.

    Parameters
    ----------
    design : ExcitationDesign
        the result of `design_excitation`

    Returns
    -------
    ExcitationDocument
        plain data; `model_dump_json(by_alias=True)` writes it
    """
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
