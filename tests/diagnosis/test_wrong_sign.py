"""Torque that is recorded with the wrong sign: one finding a joint, or one for all, and nothing else beside it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import few_or_all, only_effects, recordings, sound_arm
from identification.simulated import paper_robot
from tauscope.diagnosis import Finding, diagnose
from tauscope.diagnosis.findings.wrong_sign import with_wrong_signs
from tauscope.recording import Recording

ALL = (0, 1, 2)


def is_reversal(found: Finding, joint: int | None) -> bool:
    """Whether all of a finding is a gain of 1 + g = -1."""
    (term,) = found.terms
    return found.place == ("torque_gain_error", joint) and term.coefficients.tolist() == [-2.0]


def test_where_no_sign_is_wrong_nothing_changes() -> None:
    sound = sound_arm()
    assert with_wrong_signs(sound, []) is sound


@pytest.mark.parametrize("joints", [(2,), (0, 2)])
def test_each_joint_with_the_wrong_sign_is_a_finding_of_its_own(joints: Sequence[int]) -> None:
    sound = sound_arm()
    found = with_wrong_signs(sound, joints)
    own = {each.place[1]: each for each in found.findings if each not in sound.findings}
    assert set(own) == set(joints)
    for joint, finding in own.items():
        assert is_reversal(finding, joint)
        assert finding.confirmed
        assert finding.probability > 0.99
        assert not finding.in_model
        assert finding.gain > 0.0
        others = [each for each in ALL if each != joint]
        assert finding.before.train[joint] > 2.0 * finding.after.train[joint]
        assert finding.before.train[others] == pytest.approx(finding.after.train[others])


def test_wrong_signs_of_all_joints_are_one_finding_of_the_whole_arm() -> None:
    sound = sound_arm()
    (finding,) = with_wrong_signs(sound, ALL).findings
    assert is_reversal(finding, None)
    assert (finding.before.train > 2.0 * finding.after.train).all()


def test_without_held_out_motion_nothing_confirms_it() -> None:
    sound = replace(sound_arm(), held_out=None)
    (finding,) = with_wrong_signs(sound, [1]).findings
    assert finding.confirmed is None


def turned(joints: Sequence[int], seeds: tuple[int, ...], rng: np.random.Generator) -> list[Recording]:
    """Motions whose torque has the other sign at some joints."""
    wrong = np.isin(ALL, joints)
    return recordings(seeds, lambda arm, _: -2.0 * wrong * arm.exact.torque_exact, rng)


@pytest.mark.parametrize("effects", few_or_all("joint_spring", "payload"))
@pytest.mark.parametrize(("joints", "place"), [((1,), 1), pytest.param(ALL, None, marks=pytest.mark.slow)])
def test_recordings_with_reversed_torque_show_that_and_nothing_else(
    joints: Sequence[int], place: int | None, effects: Sequence[str] | None
) -> None:
    rng = np.random.default_rng(0)
    with only_effects(effects):
        found = diagnose(paper_robot(), turned(joints, (1, 2), rng), turned(joints, (11,), rng))
    (finding,) = found.findings
    assert is_reversal(finding, place)
