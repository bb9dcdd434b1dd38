"""What counts as a mismatch: a test alone, or an excess that can be measured as well."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.test_repetitions import observed
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from tauscope.diagnosis.noise.floor import with_pure_error


def test_a_test_that_fires_without_any_excess_is_no_mismatch() -> None:
    unlikely, likely = np.array([1e-9, 1e-9, 1e-9, 0.5]), np.ones(4)
    found = LackOfFit(unlikely, likely, np.array([0.0, 40.0, 90.0, 90.0]), np.array([0.0, 60.0, 60.0, 60.0]))
    assert found.significant == [True, True, True, False]
    assert found.mismatch == [False, False, True, False]


@pytest.mark.parametrize(("holds", "predicts"), [(True, True), (False, True), (True, False)])
def test_what_cannot_be_measured_counts_where_parameters_move_or_predictions_fail(holds: bool, predicts: bool) -> None:
    """Joint by joint: a significant excess below and above what can be measured, and one that is not significant."""
    before = LackOfFit(np.array([1e-9, 1e-9, 0.5]), np.ones(3), np.array([40.0, 90.0, 90.0]), np.full(3, 60.0))
    found = Diagnosis.mismatched.__get__(stand_in(before, [0.0, 0.0, 0.0], holds=holds, predicts=predicts))
    assert found == [not (holds and predicts), True, False]


def test_what_findings_explain_was_there_though_no_test_had_told() -> None:
    nothing = LackOfFit(np.full(3, 0.5), np.ones(3), np.zeros(3), np.full(3, 60.0))
    energy = [200.0, 8.0, 200.0]
    assert Diagnosis.mismatched.__get__(stand_in(nothing, energy, found=[1, 2])) == [False, False, True]
    assert Diagnosis.mismatched.__get__(stand_in(nothing, energy, found=[])) == [False, False, False]


def stand_in(
    before: LackOfFit, explained: list[float], *, found: Sequence[int] = (), holds: bool = True, predicts: bool = True
) -> Any:
    """What the property asks of a diagnosis, with findings at some joints."""
    terms = [SimpleNamespace(effect=SimpleNamespace(touched=lambda _, joint=joint: [joint])) for joint in found]
    return SimpleNamespace(
        findings=[SimpleNamespace(terms=terms)],
        misfit_before=before,
        constancy=SimpleNamespace(holds=holds),
        predicts=predicts,
        inflation=1.0,
        mismatch=[SimpleNamespace(explained=energy) for energy in explained],
    )


def test_a_wave_in_time_is_told_from_noise() -> None:
    waving, quiet = (observed(wave) for wave in (0.6, 0.0))
    known = with_pure_error(*quiet)
    assert known is not None
    for (unweighted, model), is_there in ((waving, True), (quiet, False)):
        rows = unweighted.with_noise(known.noise)
        left = lack_of_fit(Fitter(rows).projected(model), rows, pure_error=True)
        assert ((left.omnibus < 1e-6) == is_there).all()
        assert ((left.omnibus > 1e-3) != is_there).all()
