"""What counts as a mismatch: a test alone, or an excess that can be measured as well."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.test_repetitions import observed
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.identification.autocorrelation import Autoregression


def test_a_test_that_fires_without_any_excess_is_no_mismatch() -> None:
    unlikely, likely = np.array([1e-9, 1e-9, 1e-9, 0.5]), np.ones(4)
    found = LackOfFit(
        unlikely, likely, np.array([0.0, 40.0, 90.0, 90.0]), np.array([0.0, 60.0, 60.0, 60.0]), np.zeros(4)
    )
    assert found.significant == [True, True, True, False]
    assert found.mismatch == [False, False, True, False]


def test_a_search_begins_where_a_test_is_not_sure_yet() -> None:
    found = LackOfFit(np.array([1e-9, 0.5, 0.005, 0.5]), np.array([1.0, 5e-3, 1.0, 0.5]), *np.zeros((3, 4)))
    assert found.significant == [True, False, False, False]
    assert found.worth_a_look == [True, True, True, False]


@pytest.mark.parametrize(("holds", "predicts"), [(True, True), (False, True), (True, False)])
def test_what_cannot_be_measured_counts_where_parameters_move_or_predictions_fail(holds: bool, predicts: bool) -> None:
    """Joint by joint: a significant excess below and above what can be measured, and one that is not significant."""
    before = LackOfFit(
        np.array([1e-9, 1e-9, 0.5]), np.ones(3), np.array([40.0, 90.0, 90.0]), np.full(3, 60.0), np.zeros(3)
    )
    found = Diagnosis.mismatched.__get__(stand_in(before, [0.0, 0.0, 0.0], holds=holds, predicts=predicts))
    assert found == [not (holds and predicts), True, False]


def test_what_findings_explain_was_there_though_no_test_had_told() -> None:
    nothing = LackOfFit(np.full(3, 0.5), np.ones(3), np.zeros(3), np.full(3, 60.0), np.zeros(3))
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


def test_noise_far_above_what_repetitions_differ_by_is_a_mismatch() -> None:
    """A wave that repeats, taken for noise by the fit that has to say what noise is, is none."""
    told = {}
    for over in (1.0, 9.0):
        rows, model = observed(wave=2.0)
        noise = [JointNoise(Autoregression(np.empty(0), 1.0, 1.0)) for _ in range(3)]
        left = Fitter(rows.with_noise(noise)).fit(model).projection.residual
        sizes = [float(np.mean(each**2)) for each in left]
        noise = [replace(JointNoise(Autoregression(np.empty(0), s, s)), over_repetitions=over) for s in sizes]
        known = rows.with_noise(noise)
        told[over] = lack_of_fit(Fitter(known).fit(model), known, pure_error=False)
    assert (told[1.0].pure_error == 1.0).all()
    assert (told[9.0].pure_error < 1e-9).all()
    assert told[9.0].mismatch == [True] * 3
    assert (told[9.0].excess > told[1.0].excess).all()


def test_what_smooth_functions_hold_is_measured_where_it_is_not_chance() -> None:
    """A wave in time is one of them; alone it is all that is left beyond noise."""
    waving, quiet = (observed(wave) for wave in (0.6, 0.0))
    known, _ = with_noise(*quiet, ())
    for (unweighted, model), is_there in ((waving, True), (quiet, False)):
        rows = unweighted.with_noise(known.noise)
        left = lack_of_fit(Fitter(rows).fit(model), rows, pure_error=True)
        assert ((left.structured > 0.0) == is_there).all()
        if is_there:
            assert (left.structured < 1.2 * left.excess).all()
