"""Friction takes power, and no more than all torque is late: no step to the most probable parameters passes a bound."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis.evidence.test_linear_model import problem
from diagnosis.nominal_arm import identify_arm, nominal_rows
from tauscope.diagnosis.evidence.linear_model import LinearModel
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.model.extended import move_model, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.search import hypothesis
from tauscope.diagnosis.search.hypothesis import Laboratory, Prior
from tauscope.effects.backlash import Backlash
from tauscope.effects.load_dependent_friction import LoadDependentFriction

MODEL: Any = None
SEEDS = st.integers(0, 10_000)
PLACES = st.lists(st.integers(0, 3), min_size=1, max_size=4, unique=True)


def hold(case: Any, lower: np.ndarray, upper: np.ndarray) -> LinearModel:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(hypothesis, "_bounds", lambda model: (lower, upper))
        return hypothesis._hold_impossible(case.model, MODEL, case.scales)


@given(SEEDS, PLACES, st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_no_coefficient_passes_a_bound(seed: int, places: list[int], below: float, above: float) -> None:
    case = problem(seed)
    lower, upper = np.full(case.model.size, -np.inf), np.full(case.model.size, np.inf)
    lower[places], upper[places[0]] = -below, above
    held = hold(case, lower, upper)
    spread = np.linalg.norm(case.model.posterior(case.scales).spread, axis=1)
    step = held.posterior(case.scales).mean
    assert (step >= lower - 1e-2 * spread).all()
    assert (step <= upper + 1e-2 * spread).all()


@settings(max_examples=20)
@given(SEEDS)
def test_what_stays_within_its_bounds_is_not_touched(seed: int) -> None:
    case = problem(seed)
    lower, upper = np.full(case.model.size, -np.inf), np.full(case.model.size, np.inf)
    mean = case.model.posterior(case.scales).mean
    lower[:2], upper[1:3] = mean[:2] - 1.0, mean[1:3] + 1.0
    assert hold(case, lower, upper) is case.model


def test_a_bound_changes_the_step_and_not_how_probable_the_parameters_are(monkeypatch: pytest.MonkeyPatch) -> None:
    observations, model = nominal_rows()
    laboratory = Laboratory(EvidenceRows.prepare(observations, model), Prior.of(identify_arm(), model), repeated=True)
    start = laboratory.start(model)
    friction, size = Term(LoadDependentFriction(1), np.zeros(0), np.array([0.1])), np.array([0.1])
    moved = with_terms(start.model, [friction])
    (place,) = (own.start for own in moved.term_places())
    least = np.full(moved.size, -np.inf)
    free = laboratory.at(moved, (size,), start.scales, start.dependence)
    least[place] = -0.05  # the data ask for none of it
    monkeypatch.setattr(hypothesis, "_bounds", lambda model: (least, np.full(model.size, np.inf)))
    held = laboratory.at(moved, (size,), start.scales, start.dependence)
    assert free.posterior.mean[place] < held.posterior.mean[place] == pytest.approx(-0.05, rel=0.01)
    assert held.misfit == free.misfit


def test_a_step_leads_no_gap_beyond_the_one_by_which_the_link_moves() -> None:
    """What the link flies over and what it moves by are one gap, estimated twice."""
    play = Backlash(0, lower=np.array([1e-5, 1.0]), upper=np.array([1.0, 50.0]))
    model = with_terms(nominal_rows()[1], [Term(play, np.array([1e-3, 10.0]), np.array([1e-3]))])
    (own,) = model.term_places()
    step = np.zeros(model.size)
    step[own] = [-0.6e-3, 0.5e-3]
    (found,) = move_model(model, step).terms
    assert found.coefficients == pytest.approx([0.4e-3])
    assert found.shape[0] == pytest.approx(2.0 * 0.4e-3)
    assert not play.is_consistent(found.coefficients, found.shape)
