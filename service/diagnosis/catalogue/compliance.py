"""A transmission that gives way or has play: the link is not where the encoder on the motor's side says.

q_link = q - δ, so that to first order the torque changes by -(∂τ/∂q δ + ∂τ/∂q̇ δ' + ∂τ/∂q̈ δ'') at every joint. In δ''
stands the fourth derivative of the position: the load is smoothed before, to a band that the data choose.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape, mesh
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.dynamics import inverse_dynamics
from service.recording.recording import Array

SMALL = 1e-4
"""Step of the difference quotient by position [rad or m]: far above rounding, far below the curvature of any sine."""

WIDTHS = np.array([0.02, 0.08, 0.25])
"""Load over which the teeth change sides, relative to the joint's rms load."""


BANDS = np.array([1.0, 0.35, 0.12])
"""Bands to which the load is smoothed, relative to the common one."""

_BAND = Shape("band", "Hz", fixed=True, reported=False)


def torque_of_deflection(signals: Signals, joint: int, deflection: Array) -> Array:
    """Torque that a small deflection of one joint's transmission makes at all joints.

    Parameters
    ----------
    signals : Signals
        one piece of motion
    joint : int
        joint index, from 0
    deflection : (N,) float64
        δ, by how much the link lags the motor [rad or m]

    Returns
    -------
    (n, N) float64
        τ(q - δ) - τ(q), to first order [Nm or N]
    """
    by_position, by_velocity, by_acceleration = signals.remembered(
        f"state of {joint}", lambda: _by_state(signals, joint)
    )
    rate = signals.derivative(deflection)
    return -(by_position * deflection + by_velocity * rate + by_acceleration * signals.derivative(rate))


def _by_state(signals: Signals, joint: int) -> tuple[Array, Array, Array]:
    """∂τ/∂q_j, ∂τ/∂q̇_j, ∂τ/∂q̈_j along the motion, (n, N) each; torque is quadratic in q̇ and linear in q̈."""
    state = [np.ascontiguousarray(each.T) for each in (signals.position, signals.velocity, signals.acceleration)]
    slopes = []
    for order, step in enumerate((SMALL, 1.0, 1.0)):
        torques = []
        for sign in (0.5, -0.5):
            moved = [each.copy() if place == order else each for place, each in enumerate(state)]
            moved[order][:, joint] += sign * step
            torques.append(inverse_dynamics(signals.robot, signals.bodies, *moved).T)
        slopes.append((torques[0] - torques[1]) / step)
    return slopes[0], slopes[1], slopes[2]


def _is_loaded(setting: Setting, joint: int) -> bool:
    return setting.moves(joint) and setting.is_loaded(joint)


class JointElasticity(Effect):
    """q_link = q - τ_rb / k."""

    id: ClassVar[str] = "joint_elasticity"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"position", "velocity", "acceleration", "load"})
    equation: ClassVar[str] = "q_link = q - c tau_rb, c = 1/stiffness"
    meaning: ClassVar[str] = "the transmission gives way under load"
    remedy: ClassVar[str] = "model the joint as two masses with a stiffness between them"
    revealing_motion: ClassVar[str] = "sharp reversals from constant speed, and an encoder on the link"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "{q}/{tau}", positive=True),)
    shapes: ClassVar[tuple[Shape, ...]] = (_BAND,)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        bands = BANDS * setting.cutoff_hz
        return [
            cls(joint, bands[:, None], bands[-1:], bands[:1]) for joint in setting.joints if _is_loaded(setting, joint)
        ]

    def touched(self, joint_count: int) -> tuple[int, ...]:
        """All joints.

        Parameters
        ----------
        joint_count : int
            n
        """
        return tuple(range(joint_count))

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque of a deflection by the load.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            band of the load [Hz]
        """
        joint = self.joint or 0
        loads = [signals.smoothed(signals.load[joint], band) for band in shapes[:, 0]]
        return np.stack([torque_of_deflection(signals, joint, load) for load in loads])[:, None]


class Backlash(Effect):
    """q_link = q - b/2 tanh(τ_rb / ε)."""

    id: ClassVar[str] = "backlash"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"position", "velocity", "acceleration", "load"})
    equation: ClassVar[str] = "q_link = q - b/2 tanh(tau_rb/epsilon)"
    meaning: ClassVar[str] = "the transmission has play when the load changes sign"
    remedy: ClassVar[str] = "take up the play, or model a dead zone"
    revealing_motion: ClassVar[str] = "poses in which the joint's load passes slowly through zero"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("b", "{q}", positive=True),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("epsilon", "{tau}", logarithmic=True), _BAND)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves under load.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        made = []
        for joint in filter(lambda each: _is_loaded(setting, each), setting.joints):
            widths = WIDTHS * setting.load[joint]
            bands = BANDS[1:] * setting.cutoff_hz
            bounds = np.array([0.5 * widths[0], bands[-1]]), np.array([2.0 * widths[-1], bands[0]])
            made.append(cls(joint, mesh(widths, bands), *bounds))
        return made

    def touched(self, joint_count: int) -> tuple[int, ...]:
        """All joints.

        Parameters
        ----------
        joint_count : int
            n
        """
        return tuple(range(joint_count))

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque of the play.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 2) float64
            ε [Nm or N], band of the load [Hz]
        """
        joint = self.joint or 0
        plays = [0.5 * np.tanh(signals.smoothed(signals.load[joint], band) / width) for width, band in shapes]
        return np.stack([torque_of_deflection(signals, joint, play) for play in plays])[:, None]
