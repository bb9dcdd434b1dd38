"""Static friction of one joint: the seed paper's equations (7) to (9), with a constant offset beside them."""

import numpy as np

from tauscope.errors import IdentificationError
from tauscope.robot.robot import Array, FrictionCoefficients, FrictionShape

FRICTION_COLUMNS = ("stiction", "stribeck", "viscous", "offset")  # names of the columns of `friction_columns`
_TWO_OVER_PI = 2.0 / np.pi


def smooth_sign(velocity: Array, k_v: float | Array) -> Array:
    """Smooth sign S₀(v) = 2/π arctan(K_v v), (8); `velocity`, `k_v`: float or (...)."""
    return _TWO_OVER_PI * np.arctan(k_v * velocity)


def smooth_sign_slope(velocity: Array, k_v: float | Array) -> Array:
    """∂S₀/∂K_v = 2/π v / (1 + (K_v v)²), and by δ likewise; `velocity`, `k_v`: float or (...)."""
    return _TWO_OVER_PI * velocity / (1.0 + (k_v * velocity) ** 2)


def friction_columns(velocity: Array, shape: FrictionShape, *, offset: bool = True) -> Array:
    """Columns (N, 4 or 3) of one joint, (9): [2/π arctan(v K_v), 2/π arctan(v δ), v, 1]; `velocity`: (N,).

    Raises IdentificationError where K_v or δ is not given.
    """
    k_v, delta = _given(shape)
    columns = np.empty((4 if offset else 3, len(velocity))).T
    columns[:, 0] = smooth_sign(velocity, k_v)
    columns[:, 1] = smooth_sign(velocity, delta)
    columns[:, 2] = velocity
    if offset:
        columns[:, 3] = 1.0
    return columns


def friction_torque(coefficients: FrictionCoefficients, shape: FrictionShape, velocity: Array) -> Array:
    """Friction torque (N,), (7): τ_f = τ_s S₀(v) + τ_sc 2/π arctan(v δ) + τ_v v; `velocity`: (N,).

    The paper prints (7) without the v of its last term; (9) has it. Raises IdentificationError without K_v or δ.
    """
    weights = np.array([coefficients.stiction, coefficients.stribeck, coefficients.viscous])
    return friction_columns(velocity, shape, offset=False) @ weights


def _given(shape: FrictionShape) -> tuple[float, float]:
    if shape.k_v is None or shape.delta is None:
        missing = "k_v" if shape.k_v is None else "delta"
        raise IdentificationError(
            f"the friction curve needs {missing}: give it as friction_shape in the robot file, or have it estimated"
        )
    return shape.k_v, shape.delta
