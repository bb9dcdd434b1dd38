"""What an identification is drawn from: torque over time, conditioned again, and friction over velocity."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.dynamics.friction import smooth_sign_slope
from tauscope.identification import Identification
from tauscope.identification.dataset import Dataset, PreparedMotion
from tauscope.identification.friction_shape import shape_parameters
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array
from tauscope.robot import JointType
from tauscope.strict_model import ResultModel


def envelope_indices(values: Array, most: int) -> NDArray[np.intp]:
    """Samples, increasing (M,), with least and greatest of each of most/2 buckets of `values`, (N,); NaN gaps show."""
    count = len(values)
    if count <= most:
        return np.arange(count)
    edges = np.linspace(0, count, max(most // 2, 1) + 1).astype(np.intp)
    kept: list[int] = []
    for start, stop in pairwise(edges):
        bucket = values[start:stop]
        if np.isnan(bucket).all():
            kept.append(int(start))
        else:
            kept += sorted({int(start + np.nanargmin(bucket)), int(start + np.nanargmax(bucket))})
    return np.array(kept, dtype=np.intp)


MOST_SERIES = 6  # recordings that the friction curves are compared with
MOST_PIECES = 8  # pieces of a recording that are conditioned in search of the longest


@dataclass(frozen=True, eq=False)
class TorqueSeries:
    """One continuous piece of a recording beside what the model says."""

    recording: str
    repetitions: int
    rate_hz: float
    time: Array  # (N,) [s]
    velocity: Array  # (N, n), smoothed q̇ [rad/s or m/s]
    measured: Array  # (N, n), measured torque, NaN where none was measured [Nm or N]
    predicted: Array  # (N, n), torque of the model [Nm or N]

    @property
    def residual(self) -> Array:
        """Measured less predicted torque, (N, n) [Nm or N]."""
        return self.measured - self.predicted


def torque_series(identification: Identification, recording: Recording) -> TorqueSeries:
    """The longest of the first pieces of a recording, with the delivered model's torque."""
    longest = max(islice(_pieces(identification, recording), MOST_PIECES), key=lambda piece: len(piece.motion.time))
    motion = longest.motion
    return TorqueSeries(
        recording=recording.name,
        repetitions=motion.repetitions,
        rate_hz=motion.rate_hz,
        time=motion.time,
        velocity=motion.velocity,
        measured=np.where(motion.measured[0], motion.torque[0], np.nan),
        predicted=longest.predict_torque(identification.structure, identification.parameters[None])[0].T,
    )


def _pieces(identification: Identification, recording: Recording) -> Iterator[PreparedMotion]:
    conditioner = Conditioner.survey(recording, identification.robot)
    structure = identification.structure
    return iter(Dataset([conditioner], identification.robot, structure.base, identification.cutoff_hz))


GRID_POINTS = 241
BINS = 48
FEWEST_SAMPLES = 12  # samples in a velocity bin before its mean is shown
BEYOND = 1.15  # the curve is drawn over this many times the largest speed in the recordings


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """τ_f(v) = τ_s A(K_v v) + τ_sc A(δ v) + τ_v v + offset of one joint."""

    velocity: Array  # (G,), v, increasing, densest about zero [rad/s or m/s]
    torque: Array  # (G,), τ_f [Nm or N]
    std: Array  # (G,), its standard error, from the covariance of all its coefficients and shape constants [Nm or N]
    seen: tuple[float, float]  # (float, float), least and greatest velocity in the recordings [rad/s or m/s]
    bin_velocity: Array  # (B,), mean of each velocity bin
    bin_torque: Array  # (B,), mean of measured torque less the rigid body's

    @property
    def columns(self) -> dict[str, list[float]]:
        """The curve as columns: velocity, friction, standard error."""
        values = {"velocity": self.velocity, "friction": self.torque, "standard_error": self.std}
        return {name: each.tolist() for name, each in values.items()}


def friction_curve(identification: Identification, series: Sequence[TorqueSeries], joint: int) -> FrictionCurve:
    """The curve of one joint. `joint`: joint index, from 0."""
    speed = np.concatenate([one.velocity[:, joint] for one in series])
    residual = np.concatenate([one.residual[:, joint] for one in series])
    seen = (float(speed.min()), float(speed.max()))
    largest = BEYOND * max(abs(seen[0]), abs(seen[1]), np.finfo(float).tiny)
    velocity = largest * np.linspace(-1.0, 1.0, GRID_POINTS) ** 3
    torque = _torque(identification, joint, velocity)
    bins = _bin(speed, residual + _torque(identification, joint, speed))
    return FrictionCurve(velocity, torque, _std(identification, joint, velocity), seen, *bins)


def _columns(identification: Identification, joint: int, velocity: Array) -> tuple[list[int], Array]:
    """Global columns of the joint's friction, and their values (k, N); the rotor is no friction."""
    structure = identification.structure
    names = structure.terms[joint].names
    kept = [place for place, name in enumerate(names) if name != "rotor_inertia"]
    rows = structure.joint_term_columns(joint, velocity, np.zeros_like(velocity))[kept]
    columns = [structure.coefficient(joint, names[place]) for place in kept]
    return [column for column in columns if column is not None], rows


def _torque(identification: Identification, joint: int, velocity: Array) -> Array:
    columns, rows = _columns(identification, joint, velocity)
    return identification.parameters[columns] @ rows


def _std(identification: Identification, joint: int, velocity: Array) -> Array:
    """Standard error of τ_f, √(J Σ Jᵀ), to first order; Σ holds the logarithms of the estimated shape constants."""
    structure = identification.structure
    columns, rows = _columns(identification, joint, velocity)
    jacobian = list(rows)
    shape = identification.shapes[joint]
    for place, (owner, constant) in enumerate(shape_parameters(identification.shapes)):
        slope, coefficient = (shape.k_v, "stiction") if constant == "k_v" else (shape.delta, "stribeck")
        column = structure.coefficient(joint, coefficient)
        if owner != joint or slope is None or column is None:
            continue
        columns = [*columns, structure.size + place]
        jacobian.append(identification.parameters[column] * slope * smooth_sign_slope(velocity, slope))
    covariance = identification.covariance[np.ix_(columns, columns)]
    stacked = np.stack(jacobian)
    return np.sqrt(np.maximum(np.einsum("ig,ij,jg->g", stacked, covariance, stacked), 0.0))


def _bin(velocity: Array, torque: Array) -> tuple[Array, Array]:
    """Means in bins that are narrow about zero velocity, where friction changes most."""
    measured = np.isfinite(torque)
    velocity, torque = velocity[measured], torque[measured]
    if not len(velocity):
        return np.empty(0), np.empty(0)
    largest = max(float(np.abs(velocity).max()), np.finfo(float).tiny)
    edges = largest * np.sign(steps := np.linspace(-1.0, 1.0, BINS + 1)) * np.abs(steps) ** 1.6
    places = np.clip(np.searchsorted(edges, velocity, side="right") - 1, 0, BINS - 1)
    count = np.bincount(places, minlength=BINS)
    full = count >= FEWEST_SAMPLES
    means = [np.bincount(places, weights=of, minlength=BINS)[full] / count[full] for of in (velocity, torque)]
    return means[0], means[1]


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
    """What an identification is drawn from."""
    series = [torque_series(identification, recording) for recording in recordings[:MOST_SERIES]]
    shown = torque_series(identification, held_out[0]) if held_out else series[0]
    names = [joint.name for joint in identification.robot.joints]
    return IdentificationPlots(
        joint_types={joint.name: joint.type for joint in identification.robot.joints},
        torque=[_torque_curve(shown, place, name, held_out=bool(held_out)) for place, name in enumerate(names)],
        friction=[_friction_plot(identification, series, place, name) for place, name in enumerate(names)],
    )


def _torque_curve(series: TorqueSeries, joint: int, name: str, *, held_out: bool) -> TorqueCurve:
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


def _friction_plot(
    identification: Identification, series: Sequence[TorqueSeries], joint: int, name: str
) -> FrictionPlot:
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
