"""A spring that pushes away: a counterbalance over its dead centre, whose stiffness is negative."""

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from service.diagnosis import diagnose, document

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
