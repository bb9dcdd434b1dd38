"""Columns that a screen keeps from one model to the next: how far what they explain is from what new ones would."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import recordings
from identification.simulated import Array, paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.screening.screen import SAME_LOAD, Screen
from tauscope.effects import Effect, Signals

pytestmark = pytest.mark.slow

SHAPED_BY_LOAD = ("backlash", "joint_elasticity", "torque_ripple")


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return diagnose(paper_robot(), recordings((1, 2), None, np.random.default_rng(3)))


def beside(diagnosis: Diagnosis, factor: float) -> Fit:
    """A model whose links, and so all loads, are larger by a factor."""
    nominal = diagnosis.selection.nominal.model
    parameters = nominal.parameters.copy()
    parameters[: nominal.structure.base_count] *= factor
    return diagnosis.fitter.projected(replace(nominal, parameters=parameters))


def shaped_by_load(diagnosis: Diagnosis) -> list[Effect]:
    found = [each for each in diagnosis.screen.effects if each.id in SHAPED_BY_LOAD]
    assert {each.id for each in found} == set(SHAPED_BY_LOAD)
    return found


def grams(screen: Screen, fit: Fit) -> list[Array]:
    return [each.gram for each in screen.candidates(fit)]


@pytest.mark.parametrize(("factor", "kept"), [(1.0 + 0.9 * SAME_LOAD, True), (1.0 + 1.1 * SAME_LOAD, False)])
def test_columns_of_nearly_the_same_load_are_kept(
    diagnosis: Diagnosis, factor: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    effects = shaped_by_load(diagnosis)
    screen, made = Screen(diagnosis.fitter.observations, effects), []
    screen.candidates(beside(diagnosis, 1.0))

    def noted(effect: Effect, shapes: Array, signals: list[Signals]) -> dict[int, Array]:
        made.append(effect)
        return Screen.white_columns(screen, effect, shapes, signals)

    monkeypatch.setattr(screen, "white_columns", noted)
    screen.candidates(beside(diagnosis, factor))
    assert set(made) == (set() if kept else set(effects))


def test_what_columns_of_nearly_the_same_load_explain_is_nearly_the_same(diagnosis: Diagnosis) -> None:
    screen = Screen(diagnosis.fitter.observations, shaped_by_load(diagnosis))
    other = beside(diagnosis, 1.0 + 0.9 * SAME_LOAD)
    screen.candidates(beside(diagnosis, 1.0))
    fresh = Screen(diagnosis.fitter.observations, screen.effects)
    for kept, new in zip(screen.candidates(other), fresh.candidates(other), strict=True):
        assert np.sqrt(kept.gain) == pytest.approx(np.sqrt(new.gain), rel=2.0 * SAME_LOAD)


def test_columns_are_made_anew_where_the_load_is_another(diagnosis: Diagnosis) -> None:
    screen = Screen(diagnosis.fitter.observations, shaped_by_load(diagnosis))
    for factor in (1.0, 1.5):
        grams(screen, beside(diagnosis, factor))
    found = grams(screen, beside(diagnosis, 1.2))
    expected = grams(Screen(diagnosis.fitter.observations, screen.effects), beside(diagnosis, 1.2))
    for one, two in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-9)


def test_only_what_is_wanted_is_screened_and_as_if_all_were(diagnosis: Diagnosis) -> None:
    screen, fit = Screen(diagnosis.fitter.observations, shaped_by_load(diagnosis)), beside(diagnosis, 1.2)
    screen.candidates(beside(diagnosis, 1.0))
    every = screen.candidates(fit)
    some = screen.candidates(fit, lambda effect: effect.id == "backlash")
    expected = [each for each in every if each.effect.id == "backlash"]
    assert [each.effect for each in some] == [each.effect for each in expected] != []
    assert [each.gain for each in some] == [each.gain for each in expected]
