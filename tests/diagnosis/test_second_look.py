"""A wider band is looked at where the first one shows nothing, and believed where the first one does not object."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from concealed.generator.concealment import Concealed
from concealed.generator.trial import recorded_trial
from concealed.sealing.sealed import made
from diagnosis.diagnosed_arm import EffectTorque, at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import Diagnosis, Verdict, diagnose
from tauscope.diagnosis.in_band import selector_on
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.second_look import agrees
from tauscope.diagnosis.selection.selector import Selector
from tauscope.effects import Effect
from tauscope.effects.joint_spring import JointSpring

pytestmark = pytest.mark.slow

WIDER = "look again in a wider band"


def spring(arm: SimulatedArm, rigid: Array) -> Array:
    return at_joint(0, 0.6 * (arm.exact.exact.position[:, 0] - 0.2))


def diagnosed(effect: EffectTorque | None) -> tuple[Diagnosis, list[str]]:
    steps: list[str] = []
    found = recordings((1, 2), effect, np.random.default_rng(3))
    return diagnose(paper_robot(), found, progress=steps.append), steps


def test_nothing_is_looked_for_twice_where_something_was_found() -> None:
    diagnosis, steps = diagnosed(spring)
    assert [each.place for each in diagnosis.findings] == [("joint_spring", 0)]
    assert WIDER not in steps


def test_a_sound_arm_is_looked_at_again_and_stays_sound() -> None:
    steps: list[str] = []
    _, trial = made("sound", 18000010)
    diagnosis = diagnose(trial.robot, trial.train, trial.held_out, progress=steps.append)
    assert steps[-1] == WIDER
    assert diagnosis.verdict is Verdict.CONSISTENT
    assert diagnosis.fitter.observations.as_measured is None, "what is reported is the first look"


@pytest.mark.slow
def test_what_is_slow_or_within_frictions_step_is_not_looked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise of the velocities blurs that step, in a bristle's column and in what is left to explain alike."""
    asked: list[Effect] = []

    def remembering(*rows: Any, **counted: Any) -> Selector:
        asked.extend(rows[-1])
        return selector_on(*rows, **counted)

    monkeypatch.setattr("tauscope.diagnosis.second_look.selector_on", remembering)
    monkeypatch.setattr("tauscope.diagnosis.second_look.SPOKEN_FOR", 2.0)
    _, trial = made("sound", 18000010)
    first = diagnose(trial.robot, trial.train, trial.held_out)
    fast = {each.id for each in first.screen.effects if each.repeats_with_motion}
    assert "presliding_hysteresis" in fast, "the first look asks for it"
    assert {each.id for each in asked} == fast - {"presliding_hysteresis"}


@pytest.fixture(scope="module")
def sound() -> Diagnosis:
    return diagnosed(None)[0]


@pytest.mark.parametrize(("times", "agreed"), [(0.0, True), (1.0, True), (6.0, False), (-6.0, False)])
def test_the_first_band_objects_to_a_size_that_it_would_have_seen(sound: Diagnosis, times: float, agreed: bool) -> None:
    """Six of its own standard errors from what it estimates itself."""
    nominal = sound.selection.fit.model
    effect = JointSpring(0)
    fit = sound.fitter.fit(with_terms(nominal, [Term(effect, np.zeros(0), np.array([0.1]))]))
    estimate = fit.model.terms[0].coefficients[0]
    error = float(np.sqrt(sound.fitter.covariance(fit)[-1, -1]))
    term = Term(effect, np.zeros(0), np.array([estimate + times * error]))
    found = replace(sound.selection, fit=replace(fit, model=with_terms(nominal, [term])))
    assert agrees(sound, found) is agreed


@pytest.mark.parametrize(("stiffness", "motion_seed", "seed"), [(8200.0, 6803, 17000014), (9090.0, 6802, 17000006)])
def test_a_compliant_gear_too_weak_for_the_first_band_is_named_in_the_second(
    stiffness: float, motion_seed: int, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight standard errors strong if accelerations were known; predicted on motion that was not used as well."""
    gear = {"effect": "joint_elasticity", "joint": 3, "stiffness": stiffness, "damping": stiffness / 500.0}
    concealed = Concealed(entries=({**gear, "rotor_inertia": 0.004},))
    trial = recorded_trial("paper", concealed, motion_seed=motion_seed, seed=seed)
    seen = diagnose(trial.robot, trial.train, trial.held_out)
    assert [each.place for each in seen.findings] == [("joint_elasticity", 2)]
    assert seen.verdict is Verdict.EXPLAINED

    def one_look(first: Diagnosis, *rest: Any) -> Diagnosis:
        return first

    monkeypatch.setattr("tauscope.diagnosis.diagnosis.looked_again", one_look)
    first = diagnose(trial.robot, trial.train, trial.held_out)
    assert not first.findings
    assert seen.cutoff_hz > first.cutoff_hz
    assert [(each.effect, each.joint) for each in seen.detectable] == [
        (each.effect, each.joint) for each in first.detectable
    ], "what would have been seen is told of the whole catalogue"
    assert seen.before.train == pytest.approx(first.before.train, rel=0.01), "residuals are those of measured motion"
