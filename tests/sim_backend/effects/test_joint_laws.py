"""Effects that are a torque law of one joint: the pendulum moves as the law, written out again, says."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tauscope_sim.effects.carried_bodies import RotorInertia
from tauscope_sim.effects.friction_laws import (
    AsymmetricCoulomb,
    AsymmetricViscous,
    CoulombFriction,
    NonlinearViscous,
    PositionDependentFriction,
    StribeckFriction,
    ViscousFriction,
)
from tauscope_sim.effects.periodic_torques import CableForce, Cogging, JointSpring, TorqueOffset


def smooth_sign(v: float, k_v: float = 500.0) -> float:
    return math.atan(k_v * v) / (math.pi / 2)


LAWS: dict[str, tuple[Any, Callable[[float, float], float]]] = {
    "viscous": (ViscousFriction(joint=1, coefficient=0.7), lambda q, v: 0.7 * v),
    "coulomb": (CoulombFriction(joint=1, level=0.6), lambda q, v: 0.6 * smooth_sign(v)),
    "coulomb, own k_v": (CoulombFriction(joint=1, level=0.6, k_v=40.0), lambda q, v: 0.6 * smooth_sign(v, 40.0)),
    "stribeck": (
        StribeckFriction(joint=1, amplitude=1.5, velocity=0.35, exponent=1.35),
        lambda q, v: 1.5 * smooth_sign(v) * math.exp(-((abs(v) / 0.35) ** 1.35)),
    ),
    "asymmetric coulomb": (AsymmetricCoulomb(joint=1, amplitude=1.0), lambda q, v: smooth_sign(v) if v > 0 else 0.0),
    "asymmetric viscous": (AsymmetricViscous(joint=1, amplitude=0.6), lambda q, v: 0.6 * v if v > 0 else 0.0),
    "nonlinear viscous": (
        NonlinearViscous(joint=1, amplitude=0.5, exponent=2.2),
        lambda q, v: math.copysign(0.5 * abs(v) ** 2.2, v),
    ),
    "square root of speed": (
        NonlinearViscous(joint=1, amplitude=0.5, exponent=0.5),
        lambda q, v: math.copysign(0.5 * abs(v) ** 0.5, v),
    ),
    "position": (
        PositionDependentFriction(joint=1, amplitude=0.8, order=2.0, phase=0.4),
        lambda q, v: 0.8 * smooth_sign(v) * math.sin(2.0 * q + 0.4),
    ),
    "offset": (TorqueOffset(joint=1, torque=-0.5), lambda q, v: -0.5),
    "spring": (JointSpring(joint=1, stiffness=2.0, rest=0.1), lambda q, v: 2.0 * (q - 0.1)),
    "cable above": (CableForce(joint=1, stiffness=8.0, angle=0.45), lambda q, v: 8.0 * max(q - 0.45, 0.0) ** 1.5),
    "cable below": (
        CableForce(joint=1, stiffness=8.0, angle=0.6, side_of_angle="below", exponent=2.0),
        lambda q, v: -8.0 * max(0.6 - q, 0.0) ** 2.0,
    ),
    "cogging": (
        Cogging(joint=1, amplitude=[0.4, 0.2], order=[7.0, 44.0], phase=[0.3, 1.0]),
        lambda q, v: 0.4 * math.sin(7 * q + 0.3) + 0.2 * math.sin(44 * q + 1.0),
    ),
    "cogging of the motor": (
        Cogging(joint=1, amplitude=[0.5], order=[0.2], phase=[0.3], angle="motor"),
        lambda q, v: 0.5 * math.sin(0.2 * 50.0 * q + 0.3),
    ),
}


@pytest.mark.parametrize(
    "name", [name if name == "cogging of the motor" else pytest.param(name, marks=pytest.mark.slow) for name in LAWS]
)
def test_the_pendulum_follows_the_law(name: str, follows: Callable[..., Any]) -> None:
    effect, torque = LAWS[name]
    follows(effect, lambda t, q, v: torque(q, v))


def test_a_rotor_adds_to_the_inertia(follows: Callable[..., Any]) -> None:
    follows(RotorInertia(joint=1, inertia=0.2), lambda t, q, v: 0.0, inertia=0.2)


@pytest.mark.parametrize("name", LAWS)
def test_the_slopes_are_the_derivatives_of_the_law(name: str, pendulum: Any, rng: np.random.Generator) -> None:
    torque, slopes = LAWS[name][0].law(pendulum.robot)
    for q, v in rng.uniform(-2.0, 2.0, (50, 2)):
        step = 1e-6
        by_position = (torque(q + step, v) - torque(q - step, v)) / (2 * step)
        by_velocity = (torque(q, v + step) - torque(q, v - step)) / (2 * step)
        assert slopes(q, v) == pytest.approx((by_position, by_velocity), rel=1e-4, abs=1e-6)
