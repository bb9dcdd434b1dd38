"""A given model's wrong values told from what it lacks: the robot file's model, and a simulator's recordings."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.diagnosed_arm import only_effects
from diagnosis.loaded_arm import carrying, exact_motion, noisy, torque_of_load
from identification.simulated import paper_robot, simulate
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, against_model, against_simulation, diagnose, document
from tauscope.errors import IdentificationError
from tauscope.identification import Options
from tauscope.recording import Recording
from tauscope.robot import FrictionCoefficients, Model, Robot

SEEDS = (1, 2, 3)
MASS, PLACE = 0.3, np.array([0.05, 0.02, 0.0])


def mistaken() -> Robot:
    """The paper's arm as a simulation has it wrong: viscous friction of joint 2, no Coulomb friction of joint 3."""
    robot = paper_robot()
    friction = robot.model.friction
    assert friction is not None
    wrong = (friction[0], replace(friction[1], viscous=0.1), FrictionCoefficients(viscous=friction[2].viscous))
    return replace(robot, model=replace(robot.model, friction=wrong))


@cache
def real() -> Diagnosis:
    """Of recordings of the arm with 0.3 kg at its tool."""
    rng = np.random.default_rng(8)
    made = [noisy(exact_motion(seed, SEEDS), torque_of_load(seed, MASS, PLACE), seed, rng) for seed in SEEDS]
    with only_effects(["payload"]):
        return diagnose(mistaken(), made)


def simulated(robot: Robot) -> list[Recording]:
    return [simulate(robot, seed=seed, periods=2).recording(name=f"simulated-{seed}") for seed in (21, 22)]


def check(found: DiagnosisDocument) -> None:
    named = {(finding.effect, finding.joint): finding for finding in found.findings}
    # The simulation has no Stribeck term there either; whether 0.3 Nm of it show is another matter.
    assert set(named) - {("stribeck_friction", "joint3")} == {("payload", None), ("coulomb_friction", "joint3")}
    body = {entry.name: entry for entry in named["payload", None].parameters}
    assert abs(body["m"].value - MASS) < 4.0 * body["m"].std
    assert body["m"].std < 0.05 * MASS
    for axis, name in enumerate(("ms_x", "ms_y", "ms_z")):
        assert abs(body[name].value - MASS * PLACE[axis]) < 4.0 * body[name].std + 1e-3
    (coulomb,) = named["coulomb_friction", "joint3"].parameters
    assert abs(coulomb.value - 2.0) < 4.0 * coulomb.std
    assert [entry.parameter for entry in found.parameter_differences] == ["viscous joint2"]
    (viscous,) = found.parameter_differences
    assert viscous.simulation == pytest.approx(0.1, abs=1e-6)
    assert abs(viscous.real - 0.277) < 4.0 * viscous.std
    assert all(a < b for a, b in zip(found.fit.train.rms_after, found.fit.train.rms_before, strict=True))


@pytest.mark.slow
def test_the_models_wrong_value_is_a_difference_and_what_it_lacks_a_finding() -> None:
    found = document(against_model(real()))
    assert found.against == "model"
    assert found.verdict == "explained"
    check(found)


@pytest.mark.slow
def test_the_same_against_recordings_of_that_simulation() -> None:
    found = document(against_simulation(real(), simulated(mistaken()), Options()))
    assert found.against == "simulation"
    check(found)


def test_a_payload_is_no_finding_where_the_recordings_alone_are_looked_at() -> None:
    found = document(real())
    assert found.verdict == "consistent"
    assert not found.findings
    assert not found.parameter_differences


def test_against_a_right_model_nothing_is_wrong() -> None:
    right = carrying(paper_robot(), MASS, PLACE)
    found = document(against_model(_with_model(right)))
    assert not found.findings
    assert not found.parameter_differences
    noise = [0.5, 0.3, 0.7]
    assert found.fit.train.rms_before == pytest.approx(noise, rel=0.25)


def test_exact_recordings_of_a_simulation_are_consistent() -> None:
    """Rounding is no noise: by that, an offset of 1e-9 Nm would be certain."""
    with only_effects(["joint_spring", "cogging"]):
        found = document(diagnose(paper_robot(), simulated(paper_robot())))
    assert found.verdict == "consistent"
    assert not found.findings


def test_a_robot_without_a_model_is_refused_by_name() -> None:
    with pytest.raises(IdentificationError, match="no model block"):
        against_model(_with_model(replace(paper_robot(), model=Model(None, None))))


def _with_model(robot: Robot) -> Diagnosis:
    """The same diagnosis, of a robot file that says something else."""
    found = real()
    return replace(found, identification=replace(found.identification, robot=robot))
