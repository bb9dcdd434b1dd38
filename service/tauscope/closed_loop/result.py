"""The result of a rollout as JSON, schema ``tauscope.rollout/1``."""

from typing import Literal

from pydantic import Field

from tauscope.result_warning import ResultWarning
from tauscope.strict_model import ResultModel

ModelName = Literal["stated", "identified", "findings", "refined"]


class HorizonEntry(ResultModel):
    """Error with restarts at the real state."""

    horizon_s: float | None = Field(description="time between restarts [s]; null: one start")
    rms: list[float] = Field(description="position error per joint [rad or m]")


class ModelEntry(ResultModel):
    """One model on one recording."""

    model: ModelName = Field(
        description="stated: the robot file's model; identified: without findings; findings: with them; refined:"
        " without findings, refined by shooting segments"
    )
    rms: list[float] = Field(description="position error per joint, one start [rad or m]")
    worst: list[float] = Field(description="largest position error per joint [rad or m]")
    reversals: list[float | None] = Field(description="rms within 0.1 s of a reversal [rad or m]; null without one")
    lag: list[float] = Field(description="delay of the real motion behind the simulated one [s]")
    horizons: list[HorizonEntry] = Field(description="error by time between restarts, shortest first")
    stabiliser_rms: list[float] | None = Field(
        description="torque that drew the simulated arm to the real one [Nm or N]; null where loops closed"
    )


class RecordingEntry(ResultModel):
    """All models on one recording."""

    recording: str = Field(description="name of the recording")
    duration_s: float = Field(description="its length [s]")
    models: list[ModelEntry] = Field(description="by model")


class SummaryEntry(ResultModel):
    """One model over all recordings."""

    model: ModelName = Field(description="which one")
    rms: list[float] = Field(description="mean over recordings of the rms error per joint [rad or m]")
    worst: list[float] = Field(description="largest error per joint [rad or m]")


class RefinedEntry(ResultModel):
    """A parameter of the refined model."""

    name: str = Field(description="of the parameter, and of its link or joint")
    value: float = Field(description="after the refinement")
    std: float = Field(description="its standard error")
    unit: str = Field(description="of both")
    p_value: float | None = Field(description="of no such term; null for parameters that every model has")


class RefinementEntry(ResultModel):
    """The refinement."""

    segments: int = Field(description="pieces of 0.3 s of the training recordings")
    rms_before: float = Field(description="position error of the segments before [rad or m]")
    rms_after: float = Field(description="position error of the segments after [rad or m]")
    is_better: bool = Field(description="whether its error on the judging recordings is below that of each other model")
    parameters: list[RefinedEntry] = Field(description="what was refined")
    left_out: list[str] = Field(description="terms that are not significant, in their order")


class RolloutDocument(ResultModel):
    """A rollout."""

    schema_id: Literal["tauscope.rollout/1"] = Field(default="tauscope.rollout/1", alias="schema", description="form")
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of its joints")
    drive: Literal["loop", "torque"] = Field(description="recorded commands through loops, or recorded torque")
    delay: list[float | None] = Field(description="of each loop's command [s]; null without a loop")
    step_s: float = Field(description="step of the simulation [s]")
    recordings: list[RecordingEntry] = Field(description="by recording")
    summary: list[SummaryEntry] = Field(description="by model")
    refinement: RefinementEntry | None = Field(description="null where none was asked for")
    left_out: list[str] = Field(description="findings that no simulator has, each with the reason")
    warnings: list[ResultWarning] = Field(description="to know before the numbers")
