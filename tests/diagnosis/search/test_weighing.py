"""How probable a finding is among its rivals, and which of them takes its place."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.diagnosis.findings.finding import EQUIVALENT, FORMULA_ERROR, equivalent
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.search.exchange import Exchange
from tauscope.diagnosis.search.found import Rival, Step, Weighed
from tauscope.diagnosis.search.gates import Gates
from tauscope.effects import Effect
from tauscope.effects.cable_force import CableForce
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.rotor_inertia import RotorInertia

NOTHING: Any = None
ODDS = st.floats(-50.0, 50.0)


def term(effect: Effect) -> Term:
    return Term(effect, np.zeros(len(effect.shapes)), np.ones(len(effect.coefficients)))


def rival(log_odds: float, effect: Effect | None = None) -> Rival:
    return Rival(term(effect or CableForce(0)), NOTHING, log_odds)


def weighed(log_odds: float, *rivals: float) -> Weighed:
    return Weighed((0,), NOTHING, log_odds, tuple(map(rival, rivals)), ())


@given(ODDS)
def test_without_rivals_it_is_the_chance_of_its_odds(log_odds: float) -> None:
    alone = weighed(log_odds)
    assert alone.probability == pytest.approx(1.0 / (1.0 + np.exp(-log_odds)))
    assert alone.lead == -np.inf


@given(st.lists(ODDS, min_size=1, max_size=5))
def test_it_and_its_rivals_and_nothing_share_all_that_is_believed(odds: list[float]) -> None:
    shares = [weighed(own, *odds[:place], *odds[place + 1 :]).probability for place, own in enumerate(odds)]
    nothing = 1.0 / (1.0 + np.exp(odds).sum())
    assert sum(shares) + nothing == pytest.approx(1.0)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_rivals_that_are_as_probable_share_with_it(count: int) -> None:
    assert weighed(400.0, *[400.0] * count).probability == pytest.approx(1.0 / (1.0 + count))


def test_odds_beyond_any_number_stay_probabilities() -> None:
    assert weighed(1e6, -1e6).probability == pytest.approx(1.0)
    assert weighed(-1e6).probability == pytest.approx(0.0)


@given(st.floats(1.0, 1e4), st.floats(0.0, 1e4))
def test_what_the_data_hardly_tell_from_a_finding_is_an_alternative(log_odds: float, behind: float) -> None:
    """No formula is exact: of stronger effects a larger difference says nothing."""
    margin = EQUIVALENT + FORMULA_ERROR * log_odds
    found = equivalent(log_odds, weighed(log_odds, log_odds - behind).rivals)
    if abs(behind - margin) > 1e-6:
        assert bool(found) is (behind < margin)


@pytest.mark.parametrize(("is_confirmed", "most"), [(True, 1.0), (False, 0.5)])
def test_what_held_out_motion_contradicts_is_no_likelier_than_not(is_confirmed: bool, most: float) -> None:
    step = Step(NOTHING, 50.0, is_confirmed, NOTHING, NOTHING, np.zeros((0, 0)), 50.0)
    assert step.probability == pytest.approx(most)


@dataclass(frozen=True, eq=False)
class GivenOdds(Gates):
    """Gates whose odds are given, and the gain of one effect over another."""

    odds: dict[Place, float] = field(default_factory=dict)
    refuted: frozenset[Place] = frozenset()
    gain: float | None = None

    def attempt(self, at: Any, proposal: Any) -> Any:
        effect, place = proposal.term.effect, proposal.term.place
        stands = place not in self.refuted
        return Step(effect, self.odds[place], stands, NOTHING, NOTHING, np.zeros((0, 0)), 0.0), holding(effect)

    def prior_odds(self, effect: Any, unnamed: float) -> float:
        return 0.0

    def compare(self, at: Any, found: Any, touched: Any) -> float:
        own, other = (each.model.terms[-1].place for each in (at, found))
        return self.odds[other] - self.odds[own] if self.gain is None else self.gain


class Deciding(Exchange):
    """An exchange among effects whose odds are given."""

    gates: GivenOdds

    def _weigh(self, at: Any, places: tuple[int, ...], known: Any = None) -> Weighed:
        own, odds = at.model.terms[places[0]], self.gates.odds
        others = [each for each in (JointSpring(0), CableForce(0)) if each.id != own.effect.id]
        rivals = tuple(rival(odds[each.id, 0], each) for each in others if odds[each.id, 0] > -1.0)
        proposals: Any = tuple(SimpleNamespace(term=each.term, place=each.term.place) for each in rivals)
        kept = [term.effect for number, term in enumerate(at.model.terms) if number not in places]
        return Weighed(places, holding(*kept), odds[own.place], rivals, proposals)


def holding(*effects: Effect) -> Any:
    return SimpleNamespace(model=SimpleNamespace(terms=[term(each) for each in effects]), scales=(NOTHING,))


def deciding(odds: dict[Place, float], *nominal: Effect, refuted: frozenset[Place] = frozenset()) -> Deciding:
    return Deciding(GivenOdds(holding(*nominal), NOTHING, NOTHING, None, odds=odds, refuted=refuted))


@pytest.mark.parametrize("refuted", [False, True])
def test_a_more_probable_rival_takes_the_place_where_held_out_motion_lets_it(refuted: bool) -> None:
    odds: dict[Place, float] = {("joint_spring", 0): 20.0, ("cable_force", 0): 60.0}
    asked = deciding(odds, refuted=frozenset({("cable_force", 0)}) if refuted else frozenset[Place]())
    at, (found,) = asked.run(holding(JointSpring(0)))
    assert at.model.terms[0].effect.id == ("joint_spring" if refuted else "cable_force")
    assert bool(asked.gone) is not refuted
    assert bool(found.rivals) is not refuted, "one that is refuted is no alternative"
    if not refuted:
        assert found.log_odds == 60.0
        assert found.rivals[0].term.effect.id == "joint_spring"


def test_a_rival_that_gains_nothing_at_its_best_is_an_alternative() -> None:
    odds: dict[Place, float] = {("joint_spring", 0): 20.0, ("cable_force", 0): 60.0}
    asked = Deciding(GivenOdds(holding(), NOTHING, NOTHING, None, odds=odds, gain=0.0))
    _, (found,) = asked.run(holding(JointSpring(0)))
    assert not asked.gone
    assert found.rivals[0].log_odds == found.log_odds == 20.0
    assert found.probability == pytest.approx(0.5)


def test_the_more_probable_of_two_stays() -> None:
    odds: dict[Place, float] = {("joint_spring", 0): 60.0, ("cable_force", 0): 20.0}
    at, (found,) = deciding(odds).run(holding(JointSpring(0)))
    assert at.model.terms[0].effect.id == "joint_spring"
    assert found.rivals[0].log_odds == 20.0


@pytest.mark.parametrize(("log_odds", "named"), [(2.0, False), (4.0, True)])
def test_what_every_geared_joint_has_must_stand_out_to_be_a_finding(log_odds: float, named: bool) -> None:
    odds: dict[Place, float] = {("rotor_inertia", 0): log_odds, ("joint_spring", 0): -9.0, ("cable_force", 0): -9.0}
    _, found = deciding(odds).run(holding(RotorInertia(0)))
    assert bool(found) is named
    odds = {("joint_spring", 0): log_odds, ("cable_force", 0): -9.0}
    _, found = deciding(odds).run(holding(JointSpring(0)))
    assert found


def test_what_is_improbable_is_dropped_beside_a_nominal_effect_that_is_less_probable_still() -> None:
    odds: dict[Place, float] = {("rotor_inertia", 0): -5.0, ("joint_spring", 0): -1.0, ("cable_force", 0): -9.0}
    at, found = deciding(odds, RotorInertia(0)).run(holding(RotorInertia(0), JointSpring(0)))
    assert [each.effect.id for each in at.model.terms] == ["rotor_inertia"]
    assert not found


def test_what_takes_the_place_of_a_nominal_effect_is_added_and_what_stands_beside_it_is_not_nominal() -> None:
    odds: dict[Place, float] = {("rotor_inertia", 0): 2.0, ("joint_spring", 0): 60.0, ("cable_force", 0): -9.0}
    asked = deciding(odds, RotorInertia(0))
    at, _ = asked.run(holding(RotorInertia(0)))
    assert asked.gone == {("rotor_inertia", 0)}
    assert asked.gates.find_added_terms(at) == [0]


class Wavering(Deciding):
    """…in which each effect in another shape seems to lead."""

    def _weigh(self, at: Any, places: tuple[int, ...], known: Any = None) -> Weighed:
        own = rival(25.0, at.model.terms[places[0]].effect)
        proposals: Any = (SimpleNamespace(term=own.term, place=own.place),)
        return Weighed(places, holding(), 20.0, (own,), proposals)


def test_an_effect_takes_its_own_place_in_another_shape_only_where_that_is_clearly_more_probable() -> None:
    asked = Wavering(GivenOdds(holding(), NOTHING, NOTHING, None, odds={("joint_spring", 0): 20.0}, gain=1.0))
    _, found = asked.run(holding(JointSpring(0)))
    assert not asked.gone
    assert found[0].log_odds == 20.0
