"""Kinds of one effect: the best of them is named, and those that explain nearly as much widen its intervals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.diagnosed_arm import recordings
from diagnosis.test_fit import JOINT, SPEED, stribeck
from identification.simulated import paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.elsewhere import spread
from tauscope.diagnosis.findings.kind_spread import kinds_elsewhere
from tauscope.diagnosis.fitting.fit import FARTHEST, Fit
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.selection.choice import Choice, Kind, Selection
from tauscope.diagnosis.selection.kinds import with_best_kinds
from tauscope.diagnosis.selection.selector import Selector
from tauscope.effects import Quantity

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(3)
    found = diagnose(paper_robot(), recordings((1, 2), stribeck, rng), recordings((11,), stribeck, rng))
    assert [(each.effect.id, each.effect.joint) for each in found.selection.fit.model.terms] == [
        ("stribeck_friction", JOINT)
    ]
    return found


def weighed(diagnosis: Diagnosis, fit: Fit) -> Selection:
    """The selection with another fit in its place, weighed against the kinds of its effect."""
    asked = Selector(diagnosis.screen, diagnosis.fitter, diagnosis.held_out, pure_error=diagnosis.pure_error)
    return with_best_kinds(replace(diagnosis.selection, fit=fit), asked)


def exponent(term: Term) -> float:
    return float(term.shape[1])


def test_the_kind_that_explains_more_takes_the_place_of_the_other(diagnosis: Diagnosis) -> None:
    right, (term,) = diagnosis.selection.fit, diagnosis.selection.fit.model.terms
    assert exponent(term) == 1.0
    (form,) = [
        each
        for each in diagnosis.screen.effects
        if (each.id, each.joint) == ("stribeck_friction", JOINT) and each.grid[0, 1] == 2.0
    ]
    squared = replace(term, effect=form, shape=np.array([SPEED, 2.0]))
    wrong = diagnosis.fitter.fit(with_terms(right.model, [squared]))
    assert wrong.energy > right.energy + 2.0
    selection = weighed(diagnosis, wrong)
    assert exponent(selection.fit.model.terms[0]) == 1.0
    assert selection.fit.energy == pytest.approx(right.energy, abs=0.2)
    (choice,) = selection.choices
    assert choice.options[0].fit is selection.fit
    (other,) = choice.kinds
    assert exponent(other.term) == 2.0
    assert other.behind == pytest.approx(wrong.energy - right.energy, abs=0.2)


def test_what_is_best_already_stays_and_knows_how_far_the_others_are_behind(diagnosis: Diagnosis) -> None:
    selection = weighed(diagnosis, diagnosis.selection.fit)
    assert selection.fit is diagnosis.selection.fit
    (choice,) = selection.choices
    assert [exponent(each.term) for each in choice.kinds] == [2.0]
    assert choice.kinds[0].behind > 0.0


def test_a_constant_that_one_fit_stopped_goes_on(diagnosis: Diagnosis) -> None:
    """From δ farther from its optimum than one fit may move it."""
    right = diagnosis.selection.fit
    place = right.model.constants.index((JOINT, "delta"))
    optimum = right.model.constant(place)
    terms = list(right.model.structure.terms)
    terms[JOINT] = replace(terms[JOINT], delta=4.0 / 3.0 * FARTHEST * optimum)
    far = replace(right.model, structure=right.model.structure.with_terms(tuple(terms)))
    stopped = diagnosis.fitter.fit(far)
    assert stopped.energy > right.energy + 1.0
    selection = weighed(diagnosis, stopped)
    assert selection.fit.energy == pytest.approx(right.energy, abs=0.2)
    assert selection.fit.model.constant(place) == pytest.approx(optimum, rel=0.1)


@pytest.mark.parametrize(("behind", "inflation", "chance"), [(0.0, 1.0, 0.5), (4.0, 1.0, 0.1192), (4.0, 4.0, 0.3775)])
def test_another_kind_has_the_chance_of_its_likelihood(behind: float, inflation: float, chance: float) -> None:
    there: Any = object()
    (found,) = kinds_elsewhere(Choice((), None, 0.0, kinds=(Kind(behind, there),)), inflation)
    assert found.term is there
    assert found.chance == pytest.approx(chance, abs=1e-4)


def test_without_other_kinds_nothing_is_elsewhere() -> None:
    assert kinds_elsewhere(Choice((), None, 0.0), 1.0) == ()


def test_parameters_spread_by_their_names_and_those_only_chosen_do_not() -> None:
    here = Quantity("d", 0.02, 0.001, "s"), Quantity("T", 0.01, 0.002, "s"), Quantity("n", 1.0, 0.0, "1")
    delay, constant, order = spread(here, [(0.3, (Quantity("n", 2.0, 0.0, "1"), Quantity("d", 0.03, 0.0, "s")))])
    assert delay.std == pytest.approx(np.hypot(0.001, np.sqrt(0.3) * 0.01))
    assert (constant.std, order.std) == (0.002, 0.0)
