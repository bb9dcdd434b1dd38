"""What is left beside a finding: how certain its name is then."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tauscope.diagnosis.findings.stand_in import LEFT, certainty_as_law
from tauscope.effects import effect_class


def certainty(effect: str, before: Sequence[float], without: Sequence[float], left: Sequence[float]) -> float:
    """Of a finding that touches every joint, beside which nothing but `left` is left."""
    after = [0.0] * len(left)
    touching: Any = SimpleNamespace(is_expected=effect_class(effect).is_expected, touched=range)
    nominal, fit, alone = (fitted(each) for each in (before, after, without))
    structured: Any = SimpleNamespace(structured=np.array(left, dtype=float))
    return certainty_as_law(touching, nominal, fit, alone, structured)


def fitted(energies: Sequence[float]) -> Any:
    """A fit of which only what it leaves at every joint is asked."""
    return SimpleNamespace(joint_energies=np.array(energies, dtype=float))


def test_a_law_that_leaves_nothing_is_one() -> None:
    assert certainty("cogging", [500.0], [500.0], [0.0]) == 1.0


def test_what_leaves_as_much_as_right_and_wrong_names_do_may_be_either() -> None:
    left = 500.0 * LEFT / (1.0 - LEFT)
    assert certainty("cogging", [500.0], [500.0], [left]) == pytest.approx(0.5)


def test_what_leaves_most_of_what_was_there_is_hardly_one() -> None:
    assert certainty("cogging", [100.0], [100.0], [300.0]) < 0.05


def test_what_is_left_where_a_finding_explains_next_to_nothing_is_not_held_against_it() -> None:
    assert certainty("base_tilt", [900.0, 5.0], [900.0, 5.0], [0.0, 1000.0]) > 0.99


def test_what_others_explain_at_its_joint_counts_as_explained() -> None:
    alone, beside = (certainty("cogging", [energy], [100.0], [40.0]) for energy in (100.0, 1000.0))
    assert beside > 0.9 > alone


def test_a_geared_joint_s_rotor_is_expected_whatever_else_is_left() -> None:
    assert certainty("rotor_inertia", [100.0], [100.0], [300.0]) == 1.0
