"""What counts as a mismatch: a test alone, or an excess that can be measured as well."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from service.diagnosis.diagnosed import Diagnosis
from service.diagnosis.lack_of_fit import LackOfFit


def test_a_test_that_fires_without_any_excess_is_no_mismatch() -> None:
    unlikely, likely = np.array([1e-9, 1e-9, 1e-9, 0.5]), np.ones(4)
    found = LackOfFit(unlikely, likely, np.array([0.0, 40.0, 90.0, 90.0]), np.array([0.0, 60.0, 60.0, 60.0]))
    assert found.significant == [True, True, True, False]
    assert found.mismatch == [False, False, True, False]


@pytest.mark.parametrize(("holds", "predicts"), [(True, True), (False, True), (True, False)])
def test_what_cannot_be_measured_counts_where_parameters_move_or_predictions_fail(holds: bool, predicts: bool) -> None:
    """Joint by joint: a significant excess below and above what can be measured, and one that is not significant."""
    before = LackOfFit(np.array([1e-9, 1e-9, 0.5]), np.ones(3), np.array([40.0, 90.0, 90.0]), np.full(3, 60.0))
    stand_in = SimpleNamespace(misfit_before=before, constancy=SimpleNamespace(holds=holds), predicts=predicts)
    found = Diagnosis.mismatched.__get__(cast(Any, stand_in))
    assert found == [not (holds and predicts), True, False]
