"""The robot file's static friction as a term of the equations of motion."""

from collections.abc import Sequence
from math import atan, pi
from typing import NamedTuple

from tauscope.robot.robot import FrictionCoefficients, FrictionShape
from tauscope_sim.friction import shape_constants
from tauscope_sim.plant.coordinates import Coordinates
from tauscope_sim.plant.term import Forces, Moment, Slopes, Term

_SCALE = 2.0 / pi


class _Law(NamedTuple):
    """Friction of one joint: its number from 0, the place of its motor, levels times 2/π, steepnesses, τ_v."""

    joint: int
    place: int
    stiction: float
    k_v: float
    stribeck: float
    delta: float
    viscous: float


class StaticFriction(Term):
    """Friction τ_f = τ_s (2/π) arctan(K_v v) + τ_sc (2/π) arctan(δ v) + τ_v v of every joint, v the motor's velocity.

    Raises
    ------
    RobotFileError
        where a shape constant that is needed is missing
    """

    def __init__(
        self,
        friction: Sequence[FrictionCoefficients],
        friction_shape: Sequence[FrictionShape],
        coordinates: Coordinates,
    ) -> None:
        constants = shape_constants(friction, friction_shape)
        self._laws = [
            _Law(joint, coordinates.motor(joint), one.stiction * _SCALE, k_v, one.stribeck * _SCALE, delta, one.viscous)
            for joint, (one, (k_v, delta)) in enumerate(zip(friction, constants, strict=True))
        ]

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add τ_f."""
        velocity, friction = moment.velocity, forces.friction
        for joint, place, stiction, k_v, stribeck, delta, viscous in self._laws:
            v = velocity[place]
            friction[joint] += stiction * atan(k_v * v) + stribeck * atan(delta * v) + viscous * v

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add dτ_f/dv."""
        for _, place, stiction, k_v, stribeck, delta, viscous in self._laws:
            x, y = k_v * moment.velocity[place], delta * moment.velocity[place]
            slope = stiction * k_v / (1.0 + x * x) + stribeck * delta / (1.0 + y * y) + viscous
            slopes.by_velocity[place, place] += slope
