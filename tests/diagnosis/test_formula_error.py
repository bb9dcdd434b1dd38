"""A small effect beside a large one at its joints may be no more than the error of that one's formula."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.made_up_findings import JOINTS, NAMES, finding, form, words_of
from effects.piece_of_motion import context
from tauscope.diagnosis import Finding
from tauscope.diagnosis.documents.statement import state_finding
from tauscope.diagnosis.findings.finding import FORMULA_ERROR
from tauscope.diagnosis.findings.formula_error import doubt_formulas
from tauscope.effects.base_tilt import BaseTilt
from tauscope.effects.cable_force import CableForce
from tauscope.effects.effect import Effect
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.rotor_inertia import RotorInertia

SITES = 40
shares = st.floats(1e-6, 100.0)


def make_finding(effect: Effect, energy: float, probability: float = 0.99) -> Finding:
    """A finding that takes so much off the residual of each joint that it touches, relative to what is left."""
    before = [1.0] * JOINTS
    for joint in effect.touched(JOINTS):
        before[joint] = math.sqrt(1.0 + energy)
    return finding(effect, [0.1] * len(effect.coefficients), effect.grid[0], before=before, probability=probability)


def doubt(own: Finding, *others: Finding) -> Finding:
    """What becomes of the first."""
    return doubt_formulas([own, *others], SITES)[0]


@given(shares)
def test_the_odds_of_an_error_are_its_chance_times_the_number_of_effects(share: float) -> None:
    own = make_finding(form(JointSpring), share)
    found = doubt(own, make_finding(form(CableForce), 1.0))
    standard_deviations = math.sqrt(share / FORMULA_ERROR)
    odds = 1.0 / found.probability - 1.0 / own.probability
    assert odds == pytest.approx(SITES * math.erfc(standard_deviations / math.sqrt(2.0)), abs=0.008, rel=1e-6)


@given(shares, shares)
def test_what_explains_more_is_more_probable(first: float, second: float) -> None:
    law = make_finding(form(CableForce), 1.0)
    less, more = sorted([first, second])
    found = [doubt(make_finding(form(JointSpring), share), law).probability for share in (less, more)]
    assert found[0] <= found[1] <= 0.99


@pytest.mark.parametrize(
    "other",
    [form(CableForce, 2), form(RotorInertia)],
    ids=["at another joint", "whose formula is exact"],
)
def test_no_other_formula_is_doubted(other: Effect) -> None:
    assert doubt(make_finding(form(JointSpring), 0.01), make_finding(other, 1.0)).probability == 0.99


def test_an_effect_of_the_whole_arm_is_held_against_the_laws_of_all_joints() -> None:
    tilt = make_finding(form(BaseTilt, None), 0.2)
    assert doubt(tilt, make_finding(form(CableForce), 1.0)).formula is None
    laws = [make_finding(form(CableForce, joint), 1.0) for joint in range(JOINTS)]
    assert doubt(tilt, *laws).probability < 0.5


def test_the_headline_names_the_formula_beside_the_probability() -> None:
    own = doubt(make_finding(form(JointSpring), 0.0), make_finding(form(CableForce), 1.0))
    quantities = own.terms[0].effect.quantities(
        context(), own.terms[0].coefficients, own.terms[0].shape, own.covariances[0]
    )
    statement = state_finding(own, quantities, words_of(own), tentative=False)
    assert statement.headline.endswith(f"at {NAMES[1]} (2 %; or an error in the formula of cable force)")
    assert statement.text.endswith("do not act on this alone.")
