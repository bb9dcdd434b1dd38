"""Friction that follows a recorded temperature: named with it, and predicted at a temperature that nobody trained."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import few_or_all, only_effects
from diagnosis.warm_arm import COLD_C, PER_KELVIN, VISCOUS, warm_recordings
from effects.piece_of_motion import SIGNALS, context
from identification.simulated import paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.extended_model import model_document, restore_model
from tauscope.diagnosis.observations.channels import read_temperature
from tauscope.effects.friction_drift import FrictionDrift, ThermalDrift
from tauscope.recording.conditioning import Conditioner

TRAIN, HELD_OUT = (1, 2), (11,)
COURSES, WARMER = ((25.0, 33.0), (32.0, 38.0)), ((42.0, 45.0),)


def test_a_recorded_temperature_takes_the_place_of_friction_s_own_heat() -> None:
    arm = context()
    hottest = np.full(len(arm.speed), np.nan)
    hottest[:2] = 25.5, 40.0
    warmed = replace(arm, coldest=np.full(len(hottest), 25.0), hottest=hottest)
    forms = [each for each in FrictionDrift.forms(warmed) if isinstance(each, FrictionDrift)]
    kinds = [{(type(each), each.by_heat) for each in forms if each.joint == joint} for joint in range(3)]
    by_clock = {(FrictionDrift, False), (FrictionDrift, True)}
    assert kinds[0] == by_clock  # a sensor of whole degrees shows half a kelvin by chance
    assert kinds[1] == {(ThermalDrift, False), (FrictionDrift, False)}
    assert kinds[2] == by_clock


def test_columns_follow_the_temperature_and_are_zero_where_none_was_recorded() -> None:
    form = ThermalDrift(1, duration_s=10.0, reference_c=30.0)
    shapes = np.array([[0.0], [0.03]])
    assert not form.columns(SIGNALS, shapes).any()
    temperature = np.full((3, *SIGNALS.time.shape), np.nan)
    temperature[1] = 40.0
    line, curve = form.columns(replace(SIGNALS, temperature=temperature, _memory={}), shapes)
    assert line[1, 0] == pytest.approx(np.tile(10.0 * SIGNALS.velocity[1], (len(SIGNALS.time), 1)))
    assert curve[1, 0] == pytest.approx(line[1, 0] * (1.0 - np.exp(-0.3)) / 0.3)


def test_whole_degrees_are_smoothed() -> None:
    (recording,) = warm_recordings((1,), ((25.0, 31.0),), np.random.default_rng(1))
    conditioner = Conditioner.survey(recording, paper_robot())
    time = recording.samples().time[None]
    found = read_temperature(conditioner, time)
    assert found is not None
    true = 25.0 + 6.0 * np.sqrt(np.linspace(0.0, 1.0, time.shape[1]))
    assert np.abs(found[0, 0, 400:] - true[400:]).max() < 0.6
    assert np.abs(np.diff(found[0, 0])).max() < 0.01


SEARCHED = pytest.mark.parametrize("effects", few_or_all("friction_drift", "joint_spring"))


@pytest.mark.slow
@SEARCHED
def test_viscous_friction_that_falls_as_a_joint_warms_up_is_named_with_its_temperature(
    effects: Sequence[str] | None,
) -> None:
    rng = np.random.default_rng(7)
    train, held_out = warm_recordings(TRAIN, COURSES, rng), warm_recordings(HELD_OUT, WARMER, rng)
    with only_effects(effects):
        diagnosis = diagnose(paper_robot(), train, held_out)
    found = document(diagnosis)
    assert [(each.effect, each.joint, each.confirmed) for each in found.findings] == [
        ("friction_drift", "joint1", True)
    ]
    (drift,) = found.findings
    assert "temperature" in drift.statement
    values = {each.name: each for each in drift.parameters}
    slope = -VISCOUS * PER_KELVIN * np.exp(-PER_KELVIN * (values["T_0"].value - COLD_C))
    assert abs(values["w"].value - slope) < 2.0 * values["w"].std
    place = found.mismatch[0].where
    assert place is not None
    assert place.variable == "temperature"
    assert drift.held_out_rms_before is not None
    assert drift.held_out_rms_after is not None
    assert drift.held_out_rms_after[0] < 0.85 * drift.held_out_rms_before[0]
    (term,) = restore_model(model_document(diagnosis), paper_robot()).terms
    assert isinstance(term.effect, ThermalDrift)
    assert term.effect.reference_c == values["T_0"].value


@pytest.mark.slow
@SEARCHED
def test_a_temperature_that_friction_does_not_follow_is_no_finding(effects: Sequence[str] | None) -> None:
    rng = np.random.default_rng(7)
    train, held_out = (warm_recordings(*each, rng, per_kelvin=0.0) for each in ((TRAIN, COURSES), (HELD_OUT, WARMER)))
    with only_effects(effects):
        assert document(diagnose(paper_robot(), train, held_out)).findings == []
