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
from tauscope_sim.effects.effect import CoulombTerm, JointEffect
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
        return (_WarmingFriction(self, robot, coordinates),)


class _WarmingFriction(CoulombTerm):
    def __init__(self, drift: FrictionDrift, robot: Robot, coordinates: Coordinates) -> None:
        super().__init__(drift, robot, coordinates)
        self._viscous = self._friction.viscous
        self._coefficients = (drift.coulomb_per_kelvin, drift.viscous_per_kelvin)
        self._resistance, self._time_constant = drift.thermal_resistance, drift.time_constant
        self._start = drift.initial_temperature - AMBIENT

    def initial_states(self) -> tuple[float, ...]:
        return (self._start,)

    def act(self, moment: Moment, forces: Forces) -> None:
        v = moment.velocity[self._place]
        coulomb, viscous = self._changes(moment)
        forces.friction[self._joint] += coulomb * self._level(v) + viscous * self._viscous * v

    def rates(self, moment: Moment, rates: list[float]) -> None:
        heat = moment.friction[self._joint] * moment.velocity[self._place]
        rise = moment.states[self.first_state]
        rates[self.first_state] = (self._resistance * heat - rise) / self._time_constant

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        v, place = moment.velocity[self._place], self._place
        coulomb, viscous = self._changes(moment)
        slopes.by_velocity[place, place] += coulomb * self._slope(v) + viscous * self._viscous
        slopes.rate_by_state[self.first_state, self.first_state] -= 1.0 / self._time_constant

    def report_temperature(self, states: list[float], temperature: Array) -> None:
        temperature[self._joint] = AMBIENT + states[self.first_state]

    def _changes(self, moment: Moment) -> tuple[float, float]:
        rise = moment.states[self.first_state]
        coulomb, viscous = (math.expm1(min(c * rise, LARGEST_EXPONENT)) for c in self._coefficients)
        return coulomb, viscous
