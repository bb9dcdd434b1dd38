"""Viscous friction that differs with the direction of motion."""

import numpy as np

from tauscope.effects.asymmetric_coulomb import AsymmetricCoulomb
from tauscope.effects.context import Signals
from tauscope.effects.effect import Coefficient, per_joint_columns
from tauscope.recording.recording import Array


class AsymmetricViscous(AsymmetricCoulomb):
    """τ = b |q̇|: viscous friction is larger by b one way and smaller by b the other."""

    has_step = False
    of_motion_and_step = False
    of_motion_alone = True
    id = "asymmetric_viscous"
    rank = 20
    arguments = frozenset({"velocity"})
    equation = "tau = b |qd|: viscous friction F_v + b forwards, F_v - b backwards"
    meaning = "viscous friction differs with the direction of motion"
    remedy = "use a viscous coefficient for each direction"
    code = "{c[0]} * fabs(v)"
    revealing_motion = "fast motion in both directions"
    coefficients = (Coefficient("b", "{tau} s/{q}"),)
    friction = "viscous"
    plain = ("viscous_friction", "coefficient")

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(np.abs(signals.velocity[self.joint])[None, None])
