"""What friction compensation is made of: coefficients, drive units, and where they came from."""

import math
from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import ExportError
from tauscope.export.compensation.drive_units import UNKNOWN_UNITS, DriveUnits
from tauscope.robot import JointType
from tauscope.robot.messages import one_line, shown

# Equations (7) and (8) of the seed paper, with the constant offset that real drives have.
EQUATION = "tau = stiction*(2/pi)*atan(k_v*v) + stribeck*(2/pi)*atan(delta*v) + viscous*v + offset"


@dataclass(frozen=True)
class JointFriction:
    """Friction of one joint and the constant beside it, equations (7), (8).

    `stiction`, `stribeck`: τ_s, τ_sc [Nm or N]; their sum is the Coulomb level at speed.
    `viscous`: τ_v [Nm s/rad or N s/m].
    `offset`: constant torque [Nm or N].
    `k_v`: K_v, slope of the smooth sign [s/rad or s/m].
    `delta`: δ, shape of the Stribeck effect [s/rad or s/m]; None where the joint has none.
    """

    stiction: float
    stribeck: float
    viscous: float
    offset: float
    k_v: float
    delta: float | None = None


@dataclass(frozen=True)
class JointCompensation:
    """One joint of a compensation model.

    `type`: revolute (rad, Nm) or prismatic (m, N).
    """

    name: str
    type: JointType
    friction: JointFriction
    units: DriveUnits = UNKNOWN_UNITS


@dataclass(frozen=True)
class RecordingSource:
    """A recording that the coefficients were estimated from: its name, and the sha256 of its bytes in hexadecimal."""

    name: str
    sha256: str


@dataclass(frozen=True)
class CompensationModel:
    """Friction compensation of a robot, with its provenance."""

    robot: str
    joints: tuple[JointCompensation, ...]
    created: date
    recordings: tuple[RecordingSource, ...]
    version: str

    def __post_init__(self) -> None:
        """Refuse what no file could hold or no controller use."""
        if not self.joints:
            raise ExportError("the compensation model has no joints; identify the robot first")
        for joint in self.joints:
            check_friction(joint.name, joint.friction)


def check_friction(joint: str, friction: JointFriction) -> None:
    """Refuse coefficients that are not finite and shapes without meaning.

    Raises ExportError naming the joint and the coefficient.
    """
    for name in ("stiction", "stribeck", "viscous", "offset", "k_v"):
        if not math.isfinite(getattr(friction, name)):
            raise ExportError(one_line(f"joint {shown(joint)}: {name} is not finite; identify it from other data"))
    if friction.k_v <= 0.0:
        raise ExportError(
            one_line(f"joint {shown(joint)}: k_v = {friction.k_v:g} is not positive; give a positive k_v")
        )
    if friction.delta is None:
        if friction.stribeck != 0.0:
            raise ExportError(one_line(f"joint {shown(joint)}: has a Stribeck term but no delta; give its delta"))
    elif not (math.isfinite(friction.delta) and friction.delta > 0.0):
        text = f"joint {shown(joint)}: delta = {friction.delta:g} is not positive and finite; give a positive delta"
        raise ExportError(one_line(text))


def friction_torque(friction: JointFriction, velocity: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Friction torque τ_s S(K_v v) + τ_sc S(δ v) + τ_v v + offset, S(x) = (2/π) atan x, (N,).

    Seed paper, equations (7) and (8).

    `velocity`: v [rad/s or m/s]. Returns array of: torque of the shape of `velocity` [Nm or N].
    """
    v = np.asarray(velocity, dtype=np.float64)
    step = np.arctan(friction.k_v * v) * (2.0 / np.pi)
    stribeck = np.arctan((friction.delta or 0.0) * v) * (2.0 / np.pi)
    return friction.stiction * step + friction.stribeck * stribeck + friction.viscous * v + friction.offset
