"""Friction that changes as its own heat warms the joint.

The joint's temperature above ambient, ϑ [K], follows the heat that all its friction dissipates:

    ϑ̇ = (R τ_friction v - ϑ) / T

with the thermal resistance R [K/W] and the time constant T [s]. Coulomb and viscous part of the robot file's friction
change by their own coefficients c_c, c_v [1/K]:

    τ = (e^{c_c ϑ} - 1) (τ_s A(v) + τ_sc A_δ(v)) + (e^{c_v ϑ} - 1) τ_v v        [Nm or N]
"""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Number, Positive
from tauscope.robot.robot import Array, Robot
from tauscope_sim.effects.effect import JointEffect
from tauscope_sim.friction import shape_constants, smooth_sign, smooth_sign_slope
from tauscope_sim.plant.term import AMBIENT, Coordinates, Forces, Moment, Slopes, Term

LARGEST_EXPONENT = 20.0  # beyond any oil: keeps nonsense coefficients from overflowing


class FrictionDrift(JointEffect):
    """Static friction times e^{c ϑ}, with ϑ from dissipated heat."""

    effect_id: ClassVar[str] = "friction_drift"
    thermal_resistance: Positive  # R [K/W]
    time_constant: Positive  # T [s]
    coulomb_per_kelvin: Number = 0.0  # c_c [1/K]
    viscous_per_kelvin: Number = 0.0  # c_v [1/K]
    initial_temperature: Number = AMBIENT  # of the joint when the arm is placed [°C]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if robot.model.friction is None:
            raise self.refused("joint", "has no friction in the robot file that could drift; state model.friction")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        friction = (robot.model.friction or ())[self.index]
        shape = shape_constants([friction], [self.joint_of(robot).friction_shape])[0]
        place = coordinates.motor(self.index)
        levels = (friction.stiction, friction.stribeck, friction.viscous)
        return (_WarmingFriction(self, place, levels, shape),)


class _WarmingFriction(Term):
    state_count = 1

    def __init__(
        self, drift: FrictionDrift, place: int, levels: tuple[float, float, float], shape: tuple[float, float]
    ) -> None:
        self._joint, self._place = drift.index, place
        self._stiction, self._stribeck, self._viscous = levels
        self._k_v, self._delta = shape
        self._coefficients = (drift.coulomb_per_kelvin, drift.viscous_per_kelvin)
        self._resistance, self._time_constant = drift.thermal_resistance, drift.time_constant
        self._start = drift.initial_temperature - AMBIENT

    def initial_states(self) -> tuple[float, ...]:
        return (self._start,)

    def act(self, moment: Moment, forces: Forces) -> None:
        v = moment.velocity[self._place]
        coulomb, viscous = self._changes(moment)
        level = self._stiction * smooth_sign(v, self._k_v) + self._stribeck * smooth_sign(v, self._delta)
        forces.friction[self._joint] += coulomb * level + viscous * self._viscous * v

    def rates(self, moment: Moment, rates: list[float]) -> None:
        heat = moment.friction[self._joint] * moment.velocity[self._place]
        rise = moment.states[self.first_state]
        rates[self.first_state] = (self._resistance * heat - rise) / self._time_constant

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        v, place = moment.velocity[self._place], self._place
        coulomb, viscous = self._changes(moment)
        level = self._stiction * smooth_sign_slope(v, self._k_v) + self._stribeck * smooth_sign_slope(v, self._delta)
        slopes.by_velocity[place, place] += coulomb * level + viscous * self._viscous
        slopes.rate_by_state[self.first_state, self.first_state] -= 1.0 / self._time_constant

    def report_temperature(self, states: list[float], temperature: Array) -> None:
        temperature[self._joint] = AMBIENT + states[self.first_state]

    def _changes(self, moment: Moment) -> tuple[float, float]:
        rise = moment.states[self.first_state]
        coulomb, viscous = (math.expm1(min(c * rise, LARGEST_EXPONENT)) for c in self._coefficients)
        return coulomb, viscous
