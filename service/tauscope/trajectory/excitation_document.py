"""The form of a designed excitation's document, schema ``tauscope.excitation/1``: it can be played as a trajectory can.

It stands here and not beside the design, so that what plays it checks all of it without the optimiser and SciPy.
"""

from typing import Literal

from pydantic import Field

from tauscope.trajectory.document import TrajectoryDocument, TrajectoryPart

EXCITATION_SCHEMA = "tauscope.excitation/1"


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
