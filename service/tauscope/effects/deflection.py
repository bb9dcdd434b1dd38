"""A transmission that lets its link be elsewhere than the encoder on the motor's side says, and what torque that makes.

q_link = q - δ, so that to first order the torque changes by -(∂τ/∂q δ + ∂τ/∂q̇ δ' + ∂τ/∂q̈ δ'') at every joint. In δ''
stands the fourth derivative of the position: the load is smoothed before, to a band that the data choose.
"""

from abc import abstractmethod
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tauscope.dynamics import torque_regressor
from tauscope.effects.computation import THREADS, LastFew
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Effect, Quantities, Shape
from tauscope.recording.recording import Array

# Step of the difference quotient by position [rad or m]: far above rounding, far below the curvature of any sine.
SMALL = 1e-4
# Rates at which derivatives by position, velocity and acceleration are taken. They change with the pose, by far slower
# than a recording, that by position with the acceleration too: at the 16 joints of three simulated arms they err by
# 0.4, 0.8 and 0.02 % at most, rms.
SLOPES_HZ = (100.0, 25.0, 25.0)
# Joints whose columns' slopes are kept a piece: fits are about one or two joints at a time, and each motion needs some
# 0.1 MB a second and joint.
KEPT = 2 * THREADS
LEAST_INERTIA = 0.05  # share of a joint's largest inertia below which a fitted one is an error of the fit
# What the first order in δ, with the load of the motor's own motion, errs by, relative to the size that is found: on
# simulated arms 0.02 to 0.25 beyond the standard error.
FIRST_ORDER = 0.12
BAND = Shape("band", "Hz", fixed=True, reported=False)  # of the load that deflects the transmission
# Samples (K,) at which slopes are taken, and those of some columns of Φ there, (n, C, K): 1e-7 is more than enough.
_Slopes = tuple[NDArray[np.intp], NDArray[np.float32]]


class Deflection(Effect):
    """δ of one joint's transmission, per unit of its one coefficient: an effect says which δ its load makes."""

    no_code = "it needs the positions of all joints and the state of the link"
    no_scenario = "the simulated transmission also needs the inertia of its rotor, which was not measured"
    arguments = frozenset({"position", "velocity", "acceleration", "load"})

    @staticmethod
    def deflected_joints(context: ArmContext) -> list[int]:
        """Joints that move, whose transmission carries anything, and whose deflection was not measured."""
        hidden = [joint for joint in context.joints if joint not in context.link_encoders]
        return [joint for joint in hidden if context.moves(joint) and context.is_loaded(joint)]

    def touched(self, joint_count: int) -> tuple[int, ...]:
        return tuple(range(joint_count))

    def find_own_joints(self, joint_count: int) -> tuple[int, ...]:
        return (self.joint or 0,)

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """The size of the deflection, its standard error with that of the first order."""
        found = super().quantities(context, coefficients, shape, covariance)
        return tuple(replace(each, std=float(np.hypot(each.std, FIRST_ORDER * each.value))) for each in found)

    @abstractmethod
    def deflection(self, load: Array, inertia: Array, shape: Array, rate_hz: float) -> Array:
        """δ per unit of the coefficient along a motion, (N,).

        `load`: (N,), τ_rb, smoothed [Nm or N]; `inertia`: (N,), of the link and all that it carries, zero where it is
        not known [kg m² or kg]; `shape`: (k,), values of the shape parameters; `rate_hz`: sampling rate [Hz].
        """

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque of the deflection, of `shapes`, (g, k), `BAND` among them; periodic where the motion repeats."""
        joint, band = self.joint or 0, self.shapes.index(BAND)
        times, count = 2 if signals.periodic else 1, signals.position.shape[-1]
        inertia = np.tile(inertia_of_link(signals, joint), times)
        bands = np.unique(shapes[:, band])
        loads = {cutoff_hz: np.tile(signals.smoothed(signals.load[joint], cutoff_hz), times) for cutoff_hz in bands}
        found = np.empty((len(shapes), 1, *signals.position.shape))
        for row, shape in zip(found, shapes, strict=True):
            lag = self.deflection(loads[shape[band]], inertia, shape, signals.rate_hz)[-count:]
            row[0] = torque_of_deflection(signals, joint, lag)
        return found


def torque_of_deflection(signals: Signals, joint: int, deflection: Array) -> Array:
    """τ(q - δ) - τ(q), (n, N), to first order [Nm or N], of a joint whose link lags by a `deflection` δ, (N,)."""
    by_position, by_velocity, by_acceleration = _slopes(signals, joint)
    rate = signals.derivative(deflection)
    torque = by_position * -deflection
    torque -= by_velocity * rate
    torque -= by_acceleration * signals.derivative(rate)
    return torque


def inertia_of_link(signals: Signals, joint: int) -> Array:
    """Inertia that a joint's transmission moves, (N,) [kg m² or kg]; zero where the fit knows of none."""
    inertia = _slopes(signals, joint)[2][joint]
    return np.asarray(np.maximum(inertia, LEAST_INERTIA * max(float(inertia.max()), 0.0)))


def _slopes(signals: Signals, joint: int) -> tuple[Array, Array, Array]:
    return signals.remembered(f"state of {joint}", lambda: _by_state(signals, joint))


def _by_state(signals: Signals, joint: int) -> tuple[Array, Array, Array]:
    """∂τ/∂q_j, ∂τ/∂q̇_j, ∂τ/∂q̈_j along the motion, (n, N) each: combinations of the columns' own slopes."""
    kept: LastFew[tuple[int, bytes], list[_Slopes]] = signals.remembered_of_motion("slopes", lambda: LastFew(KEPT))
    columns = np.flatnonzero(signals.bodies)
    orders = kept.get((joint, columns.tobytes()), lambda: _slopes_of_columns(signals, joint, columns))
    parameters = signals.bodies[columns].astype(np.float32)
    every = np.arange(signals.position.shape[-1])
    by_position, by_velocity, by_acceleration = (
        np.asarray(CubicSpline(knots, (parameters @ slopes).astype(np.float64), axis=1)(every))
        for knots, slopes in orders
    )
    return by_position, by_velocity, by_acceleration


def _slopes_of_columns(signals: Signals, joint: int, columns: NDArray[np.intp]) -> list[_Slopes]:
    """The same of some columns of Φ in τ = Φ Θ by q_j, q̇_j and q̈_j; it is quadratic in q̇ and linear in q̈."""
    count = signals.position.shape[-1]
    found = []
    for order, (step, rate_hz) in enumerate(zip((SMALL, 1.0, 1.0), SLOPES_HZ, strict=True)):
        knots = np.unique(np.append(np.arange(0, count, max(int(signals.rate_hz // rate_hz), 1)), count - 1))
        state = [each.T[knots] for each in (signals.position, signals.velocity, signals.acceleration)]
        ends = []
        for sign in (0.5, -0.5):
            moved = [each.copy() if place == order else each for place, each in enumerate(state)]
            moved[order][:, joint] += sign * step
            ends.append(torque_regressor(signals.robot, *moved, columns=columns).transpose(1, 2, 0))
        found.append((knots, ((ends[0] - ends[1]) / step).astype(np.float32)))
    return found
