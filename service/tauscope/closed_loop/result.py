"""The result of a rollout as JSON, schema ``tauscope.rollout/1``."""

from typing import Literal

from pydantic import Field

from tauscope.result_warning import ResultWarning
from tauscope.strict_model import ResultModel

ModelName = Literal["stated", "identified", "findings"]


class HorizonEntry(ResultModel):
    """Error with restarts at the real state."""

    horizon_s: float | None = Field(description="time between restarts [s]; null: one start")
    rms: list[float] = Field(description="position error per joint [rad or m]")


class ModelEntry(ResultModel):
    """One model on one recording."""

    model: ModelName = Field(
        description="stated: the robot file's model; identified: without findings; findings: with them"
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
    left_out: list[str] = Field(description="findings that no simulator has, each with the reason")
    warnings: list[ResultWarning] = Field(description="to know before the numbers")
