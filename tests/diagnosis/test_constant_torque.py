"""A constant torque, and friction that is larger one way: what explains the torque better takes the other's place."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import EffectTorque, at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.robot import FrictionCoefficients, Robot

pytestmark = pytest.mark.slow


def stating_friction() -> Robot:
    """The paper's arm with a file that states friction, and with it no constant."""
    robot = paper_robot()
    return replace(robot, model=replace(robot.model, friction=(FrictionCoefficients(),) * robot.joint_count))


def one_way(arm: SimulatedArm, _: Array) -> Array:
    """Coulomb friction of joint 1, larger one way: its step is at rest only where no friction is."""
    return at_joint(0, 0.9 * np.abs(2.0 / np.pi * np.arctan(500.0 * arm.exact.exact.velocity[:, 0])))


def constant(arm: SimulatedArm, _: Array) -> Array:
    return at_joint(0, np.full(len(arm.exact.exact.velocity), 0.9))


@pytest.mark.parametrize(
    ("effect", "name"),
    [
        pytest.param(one_way, "asymmetric_coulomb", id="one way"),
        pytest.param(constant, "torque_offset", id="constant", marks=pytest.mark.proof),
    ],
)
def test_the_likelier_of_the_two_is_the_finding(effect: EffectTorque, name: str) -> None:
    found = diagnose(stating_friction(), recordings((1, 2), effect, np.random.default_rng(3)))
    (finding,) = document(found).findings
    told = {finding.effect, *(each.partition("@")[0] for each in finding.equivalent)}
    assert name in told
    assert told <= {"asymmetric_coulomb", "torque_offset"}
    assert finding.probability > 0.5
    size = finding.parameters[0]
    assert size.std is not None
    assert size.std < 0.25
    assert size.value == pytest.approx(0.9, abs=2.0 * size.std)


@pytest.mark.proof
def test_the_constant_of_a_spring_is_the_springs_own() -> None:
    """A spring at rest at 0.8 rad pushes at zero; nothing else may take that push for itself."""

    def spring(arm: SimulatedArm, _: Array) -> Array:
        return at_joint(0, 0.6 * (arm.exact.exact.position[:, 0] - 0.8))

    found = document(diagnose(stating_friction(), recordings((1, 2), spring, np.random.default_rng(3))))
    assert [(each.effect, each.joint) for each in found.findings] == [("joint_spring", "joint1")]
