"""Rotors that the robot file states are not missing from it, though they may be wrong."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.simulated import paper_robot
from tauscope.diagnosis.against.given_model import _stated_rotors

FOUND, STD = 0.2, 0.01


def diagnosis(*stated: float) -> Any:
    """Rotors found at joints 1 and 2 of an arm whose file states some."""
    robot = paper_robot()
    robot = replace(robot, model=replace(robot.model, rotor_inertia=stated or None))
    findings = [
        SimpleNamespace(
            place=("rotor_inertia", joint),
            terms=[SimpleNamespace(coefficients=np.array([FOUND]))],
            covariances=[np.array([[STD**2]])],
        )
        for joint in (0, 1)
    ]
    return SimpleNamespace(robot=robot, findings=findings)


def test_a_rotor_that_the_file_states_is_compared_with_it() -> None:
    (place, difference), *others = _stated_rotors(diagnosis(0.15, 0.0, 0.0)).items()
    assert (place, others) == (("rotor_inertia", 0), [])
    assert (difference.parameter, difference.simulation, difference.real) == ("rotor_inertia joint1", 0.15, FOUND)
    assert difference.in_std == pytest.approx(5.0)


def test_a_file_that_states_none_lacks_them() -> None:
    assert _stated_rotors(diagnosis()) == {}
