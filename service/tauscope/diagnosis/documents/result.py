"""The diagnosis as a document: what ``diagnose --json`` writes and the REST API returns (CONTRACT.md)."""

from typing import Literal

from pydantic import Field

from tauscope.result_warning import ResultWarning
from tauscope.strict_model import ResultModel


class WhereEntry(ResultModel):
    """The range of a variable in which the excess residual concentrates."""

    variable: str = Field(description="velocity, position, load, acceleration, time, temperature or motor_position")
    range: list[float] = Field(description="lowest and highest value [SI]")
    share: float = Field(description="part of the excess that lies within it")
    recording: str | None = Field(default=None, description="for time: in which recording")


class MismatchEntry(ResultModel):
    """Excess residual of one joint, before anything is named."""

    joint: str = Field(description="name of the joint")
    excess_rms: float = Field(description="what the residual exceeds the noise by, in the common band [Nm or N]")
    significant: bool = Field(description="whether more than noise is left there")
    where: WhereEntry | None = Field(description="in which part of the motion; null where it is everywhere")
    time: WhereEntry | None = Field(description="when; null where always")


class QuantityEntry(ResultModel):
    """One parameter of a finding."""

    name: str = Field(description="in the equation")
    value: float = Field(description="estimate")
    std: float = Field(description="standard error, from the joint covariance of all parameters")
    unit: str = Field(description="SI")


class HeldOutChangeEntry(ResultModel):
    """What a finding changes on held-out recordings, at every joint."""

    relative: list[float] = Field(description="change of the residual's rms; below zero is better")
    std: list[float | None] = Field(description="its standard error; null where the motion is too short to tell it")


class FindingEntry(ResultModel):
    """An effect that the nominal model leaves out."""

    effect: str = Field(description="id of the effect")
    joint: str | None = Field(description="name of the joint; null where it belongs to the whole arm")
    probability: float = Field(
        description="that it is this effect: neither one of its equivalents, nor an error of a larger one's curve,"
        " nor a stand-in for a law that the catalogue does not have"
    )
    equivalent: list[str] = Field(description="other effect@joint that these data cannot tell from it")
    equation: str = Field(description="its torque")
    parameters: list[QuantityEntry] = Field(description="estimates")
    statement: str = Field(
        description="short sentences: the physics with its size and probability, numbers, doubts, and what to do"
    )
    gain: float = Field(description="what it takes off the residual's energy, in noise variances")
    share: float | None = Field(
        default=None, description="part of its joint's explained residual energy that it explains; null for `unknown`"
    )
    confirmed: bool | None = Field(
        description="whether a joint that it acts on is predicted better on held-out recordings and no joint worse;"
        " null without any"
    )
    held_out_change: HeldOutChangeEntry | None = Field(
        default=None, description="what it changes on held-out recordings; null without any"
    )
    rms_before: list[float] = Field(description="per joint, residual of the model without it [Nm or N]")
    rms_after: list[float] = Field(description="per joint, residual of the model with all findings [Nm or N]")
    held_out_rms_before: list[float] | None = Field(description="the same on held-out recordings")
    held_out_rms_after: list[float] | None = Field(description="the same on held-out recordings")


class FitChangeEntry(ResultModel):
    """Residuals without and with all findings."""

    rms_before: list[float] = Field(description="per joint, at the recorded rate, no filter [Nm or N]")
    rms_after: list[float] = Field(description="per joint, at the recorded rate, no filter [Nm or N]")


class FitChangesEntry(ResultModel):
    """Fits on training and held-out recordings."""

    train: FitChangeEntry = Field(description="on the recordings that were explained")
    held_out: FitChangeEntry | None = Field(default=None, description="on recordings that were not used")


class MovedEntry(ResultModel):
    """A parameter that is not the same in two recordings."""

    parameter: str = Field(description="name")
    between: list[str] = Field(description="the two recordings")
    shift_in_std: float = Field(description="second less first, in standard errors of the difference")


class ConstancyEntry(ResultModel):
    """Whether the parameters hold from one recording to the next."""

    p_value: float = Field(description="chance of such differences if they do")
    moved: list[MovedEntry] = Field(description="the most clearly moved parameters")


class DetectableEntry(ResultModel):
    """The smallest size of an effect that these data would have shown."""

    effect: str = Field(description="id of the effect")
    joint: str | None = Field(description="name of the joint")
    minimum: float | None = Field(description="seen in nine of ten such data sets; null where nothing shows it")
    unit: str = Field(description="SI")
    visible: bool = Field(description="false where no torque and position along this motion can show it")


class CauseEntry(ResultModel):
    """A quantity of a link or a joint that explains a difference."""

    link: int | None = Field(default=None, description="number of the link, from 1; null where it is a joint's")
    joint: str | None = Field(default=None, description="name of the joint; null where it is a link's")
    quantity: str = Field(description="mass, first_moment_x, centre_of_mass_x, inertia_xx, stiction, viscous, …")
    simulation: float | None = Field(description="stated value; null where only the difference is known")
    value: float = Field(description="value on the arm; the difference where the quantity begins with added_")
    std: float = Field(description="standard error of the value")
    unit: str = Field(description="SI")


class DifferenceEntry(ResultModel):
    """A parameter that the simulation has wrong."""

    parameter: str = Field(description="name")
    simulation: float = Field(description="value in the simulation")
    real: float = Field(description="value on the arm")
    std: float = Field(description="standard error of the difference")
    difference_in_std: float = Field(description="real less simulation, in standard errors")
    explained_by: list[CauseEntry] = Field(
        default=[],
        description="the fewest quantities of links and joints that explain all differences, as far as this"
        " one; empty where none do",
    )


class ShiftEntry(ResultModel):
    """What the left-out effects had been doing to a parameter."""

    parameter: str = Field(description="name")
    before: float = Field(description="estimate without the findings")
    after: float = Field(description="estimate with them")
    shift_in_std: float = Field(description="in standard errors of the estimate without them")


class NextExperimentEntry(ResultModel):
    """What motion would decide what is open."""

    separates: list[str] = Field(description="effects that it tells apart")
    trajectory: str | None = Field(description="path of a trajectory; null where none was designed")
    why: str = Field(description="the motion in words, and what it decides")


class HeadroomEntry(ResultModel):
    """What a black box predicts of one joint's held-out residual, in the band of the comparison."""

    joint: str = Field(description="name of the joint")
    plain: float = Field(description="held-out rms that the nominal model leaves [Nm or N]")
    explained: float = Field(description="that the model with all findings leaves [Nm or N]")
    black_box: float | None = Field(
        description="that a black box leaves, which learned from the training recordings what the findings leave there;"
        " null where they are too few [Nm or N]"
    )
    floor: float | None = Field(description="rms of the noise; null where nothing tells it [Nm or N]")
    floor_kind: Literal["repetitions", "high_frequency", "none"] = Field(
        description="how the noise is known: by what repetitions of a motion differ, or by its density above the band"
    )
    share: float | None = Field(
        description="part of the explained model's held-out residual energy that the black box predicts;"
        " negative where it predicts worse"
    )
    share_std: float | None = Field(description="its standard error, over blocks of held-out motion")
    refuted: bool = Field(
        description="whether that is over 5 % and more than two standard errors, where the verdict says noise"
    )
    statement: str = Field(description="the same in one sentence")


class DiagnosisDocument(ResultModel):
    """Result of a diagnosis, schema tauscope.diagnosis/1."""

    schema_id: Literal["tauscope.diagnosis/1"] = Field(
        default="tauscope.diagnosis/1", alias="schema", description="name and version of this document's form"
    )
    warnings: list[ResultWarning] = Field(default=[], description="what to know of the robot file and the recordings")
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of its joints, in chain order")
    against: Literal["identified", "model", "simulation"] = Field(description="what the recordings were compared with")
    verdict: Literal["consistent", "explained", "partly_explained", "unexplained", "inconclusive", "wrong_values"] = (
        Field(description="as a whole; wrong_values: no physics is missing, but stated values are wrong")
    )
    noise_std: list[float] = Field(description="per joint, torque noise a sample [Nm or N]")
    noise_method: Literal["periods", "residual"] = Field(
        description="from differences between repeated periods, or from the whitened residual"
    )
    cutoff_hz: float = Field(description="band in which torque and effects were compared [Hz]")
    mismatch: list[MismatchEntry] = Field(description="one a joint")
    headline: str = Field(default="", description="the most important result in one sentence")
    findings: list[FindingEntry] = Field(
        description="those that held-out recordings confirm, or all without any; most explained residual energy first"
    )
    tentative: list[FindingEntry] = Field(
        default=[], description="those that held-out recordings do not confirm; the model does not have them"
    )
    fit: FitChangesEntry = Field(description="without and with all findings")
    constancy: ConstancyEntry = Field(description="whether the parameters hold from one recording to the next")
    detectable: list[DetectableEntry] = Field(description="what would have been seen, and from which size")
    parameter_differences: list[DifferenceEntry] = Field(description="what the simulation has wrong")
    wrong_values: list[str] = Field(
        default=[], description="a sentence for each link or joint whose stated values are wrong"
    )
    parameter_shifts: list[ShiftEntry] = Field(
        description="what the left-out effects had been doing to the parameters; without impossible values"
    )
    next_experiment: NextExperimentEntry | None = Field(description="what would decide what is open")
    headroom: list[HeadroomEntry] | None = Field(
        default=None, description="one a joint: what a black box still predicts; null where it was not asked for"
    )
