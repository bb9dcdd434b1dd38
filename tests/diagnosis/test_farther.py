"""In whose place forms are tried that show in a small part of the motion only."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tauscope.diagnosis.screening.screen import Candidate
from tauscope.diagnosis.selection.choice import Choice, Option
from tauscope.diagnosis.selection.farther import explained, stands
from tauscope.effects import Effect
from tauscope.effects.backlash import SpringyTeeth
from tauscope.effects.base_tilt import BaseTilt
from tauscope.effects.joint_elasticity import JointElasticity
from tauscope.effects.periodic_torque import Cogging, TorqueRipple
from tauscope.effects.presliding_hysteresis import PreslidingHysteresis


def chosen(effect: Effect) -> Choice:
    fit: Any = None
    candidate = Candidate(effect, np.zeros(4), np.ones(1), 1.0, np.eye(1), True, 1.0, 1.0)
    return Choice((Option(candidate, fit, 1.0),), None, 0.0)


def test_all_of_a_joint_and_each_effect_where_there_are_several() -> None:
    """Orders of one effect stand together; what belongs to the whole arm stands nowhere."""
    effects = (Cogging(3), PreslidingHysteresis(1), Cogging(3), JointElasticity(1), BaseTilt(None))
    selection: Any = SimpleNamespace(choices=[chosen(each) for each in effects])
    bristles, spring, order = ("presliding_hysteresis", 1), ("joint_elasticity", 1), ("cogging", 3)
    assert stands(selection) == [(1, {bristles, spring}), (1, {spring}), (1, {bristles}), (3, {order})]


def test_so_many_that_they_are_no_physics_stand_together_only() -> None:
    effects = (Cogging(1), PreslidingHysteresis(1), TorqueRipple(1), JointElasticity(1))
    selection: Any = SimpleNamespace(choices=[chosen(each) for each in effects])
    assert stands(selection) == [(1, {(each.id, 1) for each in effects})]


@pytest.mark.parametrize(("energy", "better"), [(92.0, False), (85.0, True)])
def test_teeth_take_the_place_of_a_spring_where_they_explain_clearly_more(energy: float, better: bool) -> None:
    """With next to no gap they are a spring on which the link swings, and a resonance fits some noise."""

    def selected(effect: Effect, energy: float) -> Any:
        return SimpleNamespace(choices=[chosen(effect)], fit=SimpleNamespace(energy=energy))

    spring, teeth = selected(JointElasticity(1), 100.0), selected(SpringyTeeth(1), energy)
    assert (explained(teeth) > explained(spring)) is better
