"""Compliance and play from an encoder on the link: their size, what mounting adds, and a joint that is rigid."""

from collections.abc import Sequence

import numpy as np
import pytest

from diagnosis.diagnosed_arm import few_or_all, only_effects
from diagnosis.linked_arm import linked_recordings
from identification.simulated import Array, paper_robot
from tauscope.diagnosis import Diagnosis, diagnose, document
from tauscope.diagnosis.deflection.measured import MeasuredDeflection, measure_deflection
from tauscope.diagnosis.extended_model import model_document, restore_model
from tauscope.diagnosis.model.nominal import nominal_model
from tauscope.effects import possible_effects
from tauscope.identification import identify
from tauscope.recording import Recording, examine_recording

SEEDS, CUTOFF_HZ = (1, 2), 8.0
FOURTEEN_BIT = 2.0 * np.pi / 2**14
COMPLIANCE, PLAY = (0.0, 3e-4, 8e-4), (4e-3, 0.0, 0.0)


def measure(recordings: list[Recording]) -> tuple[MeasuredDeflection, ...]:
    found = identify(paper_robot(), recordings)
    return measure_deflection(recordings, found, nominal_model(found), CUTOFF_HZ)


@pytest.mark.parametrize("step", [0.0, FOURTEEN_BIT], ids=["fine", "14 bit"])
def test_compliance_and_play_are_measured_within_their_errors(step: float) -> None:
    rng = np.random.default_rng(3)
    first, second, third = measure(linked_recordings(SEEDS, rng, compliance=COMPLIANCE, play=PLAY, step=step))
    assert not first.is_compliant
    assert abs(first.play - PLAY[0]) < 2.0 * first.play_std < 0.2 * PLAY[0]
    for found, true in ((second, COMPLIANCE[1]), (third, COMPLIANCE[2])):
        assert not found.has_play
        assert abs(found.compliance - true) < 2.0 * found.compliance_std < 0.2 * true


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.0, FOURTEEN_BIT], ids=["fine", "14 bit"])
def test_rigid_joints_show_neither_whatever_mounting_and_wiring_add(step: float) -> None:
    for seed in range(5):
        found = measure(linked_recordings(SEEDS, np.random.default_rng(seed), step=step))
        assert not any(each.is_compliant or each.has_play for each in found)


def test_a_load_that_keeps_its_sign_says_nothing_of_play() -> None:
    rng = np.random.default_rng(3)
    (recording,) = linked_recordings((3,), rng, compliance=COMPLIANCE)
    samples = recording.samples()
    assert samples.link_position is not None
    found = identify(paper_robot(), [recording])
    second = measure_deflection([recording], found, nominal_model(found), CUTOFF_HZ)[1]
    assert np.isinf(second.play_std)
    assert not second.has_play
    assert abs(second.compliance - COMPLIANCE[1]) < 2.0 * second.compliance_std


def with_links(recording: Recording, link: Array) -> Recording:
    """The recording with other columns qlink."""
    samples = recording.samples()
    return Recording.from_arrays(recording.name, samples.time, samples.position, samples.effort, link_position=link)


def test_an_encoder_that_is_read_late_shows_no_deflection() -> None:
    """Eight milliseconds at 2 rad/s are 16 mrad, far more than any play."""
    recordings = linked_recordings(SEEDS, np.random.default_rng(3), mounting=False)
    late = []
    for each in recordings:
        samples = each.samples()
        link = [np.interp(samples.time - 8e-3, samples.time, own) for own in samples.position.T]
        late.append(with_links(each, np.column_stack(link)))
    assert not any(each.is_compliant or each.has_play for each in measure(late))


def test_columns_that_are_no_encoders_are_not_used_and_said() -> None:
    (recording,) = linked_recordings((1,), np.random.default_rng(3), mounting=False)
    position = recording.samples().position
    claimed = examine_recording(with_links(recording, position * [1.0, -1.0, 57.3]), paper_robot())
    assert measure([claimed]) == ()
    assert [(each.code, each.joint) for each in claimed.notes] == [
        ("link-encoder", joint) for joint in ("joint1", "joint2", "joint3")
    ]
    assert "repeats column q1" in claimed.notes[0].text


def test_an_encoder_that_misses_most_samples_says_nothing() -> None:
    (recording,) = linked_recordings((1,), np.random.default_rng(3), compliance=COMPLIANCE)
    link = recording.samples().link_position
    assert link is not None
    assert measure([with_links(recording, np.where(np.arange(len(link))[:, None] % 100 < 60, np.nan, link))]) == ()


def test_links_whose_angle_wraps_are_measured_as_any_other() -> None:
    rng = np.random.default_rng(3)
    recordings = linked_recordings(SEEDS, rng, compliance=COMPLIANCE)
    wrapped = []
    for each in recordings:
        link = each.samples().link_position
        assert link is not None
        wrapped.append(with_links(each, np.mod(link + 2.0, 2.0 * np.pi)))
    for one, other in zip(measure(recordings), measure(wrapped), strict=True):
        assert other.compliance == pytest.approx(one.compliance, abs=0.01 * one.compliance_std)


SEARCHED = pytest.mark.parametrize("effects", few_or_all("joint_spring"))


def diagnosed(effects: Sequence[str] | None, **deflection: tuple[float, ...]) -> Diagnosis:
    rng = np.random.default_rng(7)
    train, held_out = (linked_recordings(seeds, rng, **deflection) for seeds in (SEEDS, (11,)))  # type: ignore[arg-type]
    with only_effects(effects):
        return diagnose(paper_robot(), train, held_out)


@pytest.mark.slow
@SEARCHED
def test_a_diagnosis_names_what_the_encoders_show(effects: Sequence[str] | None) -> None:
    diagnosis = diagnosed(effects, compliance=(0.0, 3e-4, 0.0), play=PLAY)
    found = document(diagnosis)
    named = {(each.effect, each.joint): each for each in found.findings}
    assert {("backlash", "joint1"), ("joint_elasticity", "joint2")} <= set(named)
    (compliance,) = named["joint_elasticity", "joint2"].parameters
    assert abs(compliance.value - 3e-4) < 2.0 * compliance.std
    assert all(named[place].probability > 0.99 for place in (("backlash", "joint1"), ("joint_elasticity", "joint2")))
    assert named["joint_elasticity", "joint2"].confirmed
    limits = {(each.effect, each.joint): each.minimum for each in found.detectable}
    assert limits["joint_elasticity", "joint3"] is not None
    terms = diagnosis.selection.fit.model.terms
    again = restore_model(model_document(diagnosis), paper_robot()).terms
    assert [type(term.effect) for term in again] == [type(term.effect) for term in terms]


@pytest.mark.slow
@SEARCHED
def test_a_rigid_joint_is_never_called_elastic(effects: Sequence[str] | None) -> None:
    """The torque of a spring that the motors do not show is none of a transmission."""
    found = diagnosed(effects)
    assert not [each for each in possible_effects(found.setting) if each.id in ("joint_elasticity", "backlash")]
    assert document(found).verdict == "consistent"
