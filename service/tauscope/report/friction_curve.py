"""Friction of a joint over its velocity, with what is known about it, and what the recordings show of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.dynamics.friction import smooth_sign_slope
from tauscope.identification import Identification
from tauscope.identification.friction_shape import shape_parameters
from tauscope.recording.recording import Array
from tauscope.report.series import TorqueSeries

GRID_POINTS = 241
BINS = 48
FEWEST_SAMPLES = 12  # samples in a velocity bin before its mean is shown
BEYOND = 1.15  # the curve is drawn over this many times the largest speed in the recordings


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """τ_f(v) = τ_s A(K_v v) + τ_sc A(δ v) + τ_v v + offset of one joint.

    `seen`: (float, float), least and greatest velocity in the recordings [rad/s or m/s].
    `bin_velocity`, `bin_torque`: (B,), mean velocity, and mean of measured torque less the rigid body's, in velocity
        bins.
    """

    velocity: Array  # (G,), v, increasing, densest about zero [rad/s or m/s]
    torque: Array  # (G,), τ_f [Nm or N]
    std: Array  # (G,), its standard error, from the covariance of all its coefficients and shape constants [Nm or N]
    seen: tuple[float, float]
    bin_velocity: Array
    bin_torque: Array

    @property
    def columns(self) -> dict[str, list[float]]:
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
