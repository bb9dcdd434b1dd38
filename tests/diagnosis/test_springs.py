"""Springs and cables whose law is easily taken for another: a stiffness below zero, an exponent between two onsets."""

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose, document

STIFFNESS, REST = -3.0, 0.3


def counterbalance(arm: SimulatedArm, rigid: Array) -> Array:
    """τ = k (q - q_0), k < 0, at the third joint."""
    return at_joint(2, STIFFNESS * (arm.exact.exact.position[:, 2] - REST))


@pytest.mark.slow
def test_a_spring_that_pushes_away_is_named_with_its_stiffness() -> None:
    rng = np.random.default_rng(5)
    found = diagnose(paper_robot(), recordings((1, 2), counterbalance, rng), recordings((11,), counterbalance, rng))
    springs = [each for each in document(found).findings if each.effect == "joint_spring"]
    assert [each.joint for each in springs] == [found.robot.joints[2].name]
    (stiffness,) = [each for each in springs[0].parameters if each.name == "k"]
    assert abs(stiffness.value - STIFFNESS) < 4.0 * stiffness.std
    assert stiffness.std < 0.1 * abs(STIFFNESS)


def cable(arm: SimulatedArm, rigid: Array) -> Array:
    """τ = 12 max(q + 0.41, 0)^1.5 at the third joint: the onset lies between two of the grid."""
    return at_joint(2, 12.0 * np.maximum(arm.exact.exact.position[:, 2] + 0.41, 0.0) ** 1.5)


@pytest.mark.proof
def test_a_cable_is_told_with_its_exponent_wherever_it_sets_in() -> None:
    """The square from another onset comes nearer than it on the grid, and leaves offsets that are not there."""
    rng = np.random.default_rng(5)
    found = document(diagnose(paper_robot(), recordings((1, 2), cable, rng), recordings((11,), cable, rng)))
    assert [(each.effect, each.joint) for each in found.findings] == [("cable_force", "joint3")]
    values = {each.name: each.value for each in found.findings[0].parameters}
    assert values == {
        "k": pytest.approx(12.0, rel=0.01),
        "q_t": pytest.approx(-0.41, abs=0.02),
        "p": pytest.approx(1.5),
    }
