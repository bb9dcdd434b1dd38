"""Bristle-like rise of friction after each reversal: the Coulomb part of the joint's friction becomes a state.

The bristles' deflection z, as a part of their largest, follows the motor's velocity v over a distance x_s [rad or m]:

    Dahl:   ż = (v - |v| z) / x_s,            τ = τ_s z - τ_s A(v)
    LuGre:  ż = (v - |v| z / g(v)) / x_s,     τ = τ_s z + σ₁ x_s ż - τ_s A(v) - τ_sc A_δ(v),
            g(v) = 1 + (τ_sc/τ_s) (2/π) arctan(δ |v|).

What is subtracted is the static friction that the bristles replace (`tauscope_sim.friction`): steady sliding, where
z = ±1 or ±g(v), takes as much torque as before. τ_s, τ_sc in Nm (N), σ₁ in Nm s/rad (N s/m), z without unit.
"""

import math
from typing import Annotated, ClassVar

from tauscope.robot.document_fields import Positive
from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import CoulombTerm, JointEffect, NotNegative, one_of
from tauscope_sim.friction import smooth_sign
from tauscope_sim.plant.term import Coordinates, Forces, Moment, Slopes, Term


class PreslidingHysteresis(JointEffect):
    """Dahl's or the LuGre model in place of the joint's Coulomb friction."""

    effect_id: ClassVar[str] = "presliding_hysteresis"
    distance: Positive  # x_s, over which friction builds up [rad or m]
    bristles: Annotated[str, one_of("dahl", "lugre")] = "dahl"
    damping: NotNegative = 0.0  # σ₁ of the LuGre model [Nm s/rad or N s/m]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        friction = robot.model.friction
        coefficients = friction[self.index] if friction is not None else None
        if coefficients is None or min(coefficients.stiction, coefficients.stiction + coefficients.stribeck) <= 0.0:
            raise self.refused("joint", "has no Coulomb friction in the robot file that bristles could replace")
        if self.bristles == "dahl" and self.damping > 0.0:
            raise self.refused("damping", "belongs to the LuGre model; state bristles: lugre or remove it")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        return (_Bristles(self, robot, coordinates),)


class _Bristles(CoulombTerm):
    """LuGre's bristles; Dahl's are those without Stribeck part and damping."""

    def __init__(self, effect: PreslidingHysteresis, robot: Robot, coordinates: Coordinates) -> None:
        super().__init__(effect, robot, coordinates)
        self._stribeck = self._stribeck if effect.bristles == "lugre" else 0.0
        self._distance, self._damping = effect.distance, effect.damping * effect.distance

    def initial_states(self) -> tuple[float, ...]:
        return (0.0,)

    def act(self, moment: Moment, forces: Forces) -> None:
        v, z = moment.velocity[self._place], moment.states[self.first_state]
        forces.friction[self._joint] += self._stiction * z + self._damping * self._rate(v, z) - self._level(v)

    def rates(self, moment: Moment, rates: list[float]) -> None:
        rates[self.first_state] = self._rate(moment.velocity[self._place], moment.states[self.first_state])

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        place, state = self._place, self.first_state
        v, z = moment.velocity[place], moment.states[state]
        level = self._bend(v)
        by_velocity = (1.0 - math.copysign(z / level, v)) / self._distance
        by_state = -abs(v) / level / self._distance
        slopes.rate_by_velocity[state, place] += by_velocity
        slopes.rate_by_state[state, state] += by_state
        slopes.by_velocity[place, place] += self._damping * by_velocity - self._slope(v)
        slopes.by_state[place, state] += self._stiction + self._damping * by_state

    def _bend(self, v: float) -> float:
        """g(v)."""
        return 1.0 + self._stribeck / self._stiction * smooth_sign(abs(v), self._delta)

    def _rate(self, v: float, z: float) -> float:
        return (v - abs(v) * z / self._bend(v)) / self._distance
