"""Friction takes power: no step to the most probable parameters leaves it negative."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis.evidence.test_linear_model import problem
from tauscope.diagnosis.search import hypothesis

MODEL: Any = None
SEEDS = st.integers(0, 10_000)


@settings(max_examples=60)
@given(SEEDS, st.lists(st.integers(0, 3), min_size=1, max_size=4, unique=True), st.floats(0.0, 2.0))
def test_no_coefficient_that_cannot_be_negative_becomes_so(seed: int, places: list[int], largest: float) -> None:
    case = problem(seed)
    values = np.full(case.model.size, np.nan)
    values[places] = np.random.default_rng([seed, 5]).uniform(0.0, largest, len(places))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(hypothesis, "_one_sided", lambda model: values)
        held = hypothesis._hold_impossible(case.model, MODEL, case.scales)
    free = case.model.posterior(case.scales)
    spread = np.linalg.norm(free.spread, axis=1)
    after = values + held.posterior(case.scales).mean
    assert (after[places] >= -1e-2 * spread[places]).all()


@settings(max_examples=20)
@given(SEEDS)
def test_what_stays_positive_is_not_touched(seed: int) -> None:
    case = problem(seed)
    values = np.full(case.model.size, np.nan)
    values[:2] = 1.0 - case.model.posterior(case.scales).mean[:2]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(hypothesis, "_one_sided", lambda model: values)
        assert hypothesis._hold_impossible(case.model, MODEL, case.scales) is case.model
