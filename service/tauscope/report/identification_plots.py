"""What an identification is drawn from: torque over time and friction over velocity, as plain data."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from tauscope.identification import Identification
from tauscope.recording import Recording
from tauscope.recording.recording import Array
from tauscope.report.friction_curve import friction_curve
from tauscope.report.series import MOST_SERIES, TorqueSeries, envelope_indices, torque_series
from tauscope.robot import JointType
from tauscope.strict_model import ResultModel

MOST_POINTS = 4000  # points of one joint's torque: more than any screen is wide, so that a zoom shows more


class TorqueCurve(ResultModel):
    """Measured and predicted torque of one joint along one recording, at the recorded rate, no filter."""

    joint: str = Field(description="name of the joint")
    recording: str = Field(description="name of the recording")
    held_out: bool = Field(description="whether the model was not made from it")
    time: list[float] = Field(description="[s]")
    measured: list[float | None] = Field(description="null where none was measured [Nm or N]")
    predicted: list[float] = Field(description="torque of the model [Nm or N]")


class FrictionPlot(ResultModel):
    """Friction of one joint over its velocity."""

    joint: str = Field(description="name of the joint")
    velocity: list[float] = Field(description="increasing [rad/s or m/s]")
    friction: list[float] = Field(description="of the model [Nm or N]")
    std: list[float] = Field(description="its standard error [Nm or N]")
    seen: list[float] = Field(description="least and greatest velocity in the recordings [rad/s or m/s]")
    measured_velocity: list[float] = Field(description="mean of each velocity bin [rad/s or m/s]")
    measured_friction: list[float] = Field(description="mean measured less rigid-body torque in it [Nm or N]")


class IdentificationPlots(ResultModel):
    """Data of an identification's figures, schema tauscope.identification-plots/1."""

    schema_id: Literal["tauscope.identification-plots/1"] = Field(
        default="tauscope.identification-plots/1", alias="schema", description="name and version of this form"
    )
    joint_types: dict[str, JointType] = Field(
        default={}, description="how each joint moves, by its name: its units are Nm and rad, or N and m"
    )
    torque: list[TorqueCurve] = Field(description="one a joint, of the first held-out recording, or the first at all")
    friction: list[FrictionPlot] = Field(description="one a joint")


def identification_plots(
    identification: Identification, recordings: Sequence[Recording], held_out: Sequence[Recording]
) -> IdentificationPlots:
    series = [torque_series(identification, recording) for recording in recordings[:MOST_SERIES]]
    shown = torque_series(identification, held_out[0]) if held_out else series[0]
    names = [joint.name for joint in identification.robot.joints]
    return IdentificationPlots(
        joint_types={joint.name: joint.type for joint in identification.robot.joints},
        torque=[_torque(shown, place, name, held_out=bool(held_out)) for place, name in enumerate(names)],
        friction=[_friction(identification, series, place, name) for place, name in enumerate(names)],
    )


def _torque(series: TorqueSeries, joint: int, name: str, *, held_out: bool) -> TorqueCurve:
    """One joint's torque, thinned so that neither curve loses a peak."""
    measured, predicted = series.measured[:, joint], series.predicted[:, joint]
    ends = [envelope_indices(curve, MOST_POINTS // 2) for curve in (measured, predicted)]
    kept = np.unique(np.concatenate(ends))
    return TorqueCurve(
        joint=name,
        recording=series.recording,
        held_out=held_out,
        time=_digits(series.time[kept] - series.time[0], 4),
        measured=[value if np.isfinite(value) else None for value in _digits(measured[kept], 4)],
        predicted=_digits(predicted[kept], 4),
    )


def _friction(identification: Identification, series: Sequence[TorqueSeries], joint: int, name: str) -> FrictionPlot:
    curve = friction_curve(identification, series, joint)
    return FrictionPlot(
        joint=name,
        velocity=_digits(curve.velocity, 6),
        friction=_digits(curve.torque, 6),
        std=_digits(curve.std, 6),
        seen=list(curve.seen),
        measured_velocity=_digits(curve.bin_velocity, 6),
        measured_friction=_digits(curve.bin_torque, 6),
    )


def _digits(values: Array, decimals: int) -> list[float]:
    """Values to a decimal place that no plot resolves."""
    return np.round(values, decimals).tolist()
