"""Halving the step quarters the error, with friction that reverses, elasticity, backlash, bristles and loads."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.effects.carried_bodies import PayloadChange
from tauscope_sim.effects.elastic_transmissions import Backlash, JointElasticity
from tauscope_sim.effects.external_contact import ExternalContact
from tauscope_sim.effects.friction_drift import FrictionDrift
from tauscope_sim.effects.friction_laws import LoadDependentFriction
from tauscope_sim.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope_sim.plant import Plant

Array = NDArray[np.float64]

CASES: dict[str, Sequence[Any]] = {
    "friction": [],
    "elasticity": [JointElasticity(joint=2, stiffness=2000.0, damping=0.5, rotor_inertia=0.3)],
    "backlash": [Backlash(joint=3, gap=0.01, contact_stiffness=2000.0, rotor_inertia=0.1)],
    "bristles": [PreslidingHysteresis(joint=3, distance=0.01, bristles="lugre", damping=1.0)],
    "load": [LoadDependentFriction(joint=joint, mu=0.2) for joint in (1, 2, 3)],
    "much at once": [
        JointElasticity(joint=1, stiffness=2000.0, rotor_inertia=0.2),
        LoadDependentFriction(joint=2, mu=0.1),
        PreslidingHysteresis(joint=3, distance=0.01),
        FrictionDrift(joint=2, thermal_resistance=3.0, time_constant=2.0, viscous_per_kelvin=-0.02),
        PayloadChange(mass=0.3, start=0.1234, end=0.4),
        ExternalContact(force=[3.0, 1.0, -5.0], start=0.2011, duration=0.1),
    ],
}


def end(robot: Robot, effects: Sequence[Any], step_s: float) -> Array:
    """Positions along a motion with several reversals."""
    plant = Plant(robot, effects, step_s=step_s)
    plant.place([0.2, -1.2, 0.9])
    rows = []
    for number in range(12):
        phase = 2.0 * np.pi * number / 12 * np.array([1.5, 2.0, 3.0])
        plant.advance(np.array([0.0, 7.0, 2.0]) + np.array([8.0, 9.0, 6.0]) * np.sin(phase), 0.02)
        state = plant.state
        rows.append(np.concatenate([state.motor_position, state.link_position]))
    return np.array(rows)


@pytest.mark.parametrize(
    "name", [name if name == "friction" else pytest.param(name, marks=pytest.mark.slow) for name in CASES]
)
def test_second_order(name: str, paper: Robot) -> None:
    robot = paper
    if name == "backlash":
        robot = replace(paper, gravity=np.zeros(3))
    finest = end(robot, CASES[name], 3.125e-5)
    steps = np.array([2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4])
    errors = np.array([np.max(np.abs(end(robot, CASES[name], step) - finest)) for step in steps])
    assert errors[2] < 1e-4
    # how a reversal falls between steps makes single errors larger or smaller: the trend over four halvings counts
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order > 1.6, f"{order:.2f}: {errors}"
