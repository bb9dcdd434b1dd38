"""Robot files whose inertials no body can have: repaired, said, believed less, and no worse a model for it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from diagnosis.diagnosed_arm import only_effects
from identification.simulated import PAPER_NOISE, SimulatedArm, paper_robot, simulate
from shared_data import SHARED_CASES, needs_shared_cases
from tauscope.diagnosis import against_model, diagnose
from tauscope.diagnosis import document as diagnosis_document
from tauscope.excitation import design_excitation
from tauscope.excitation.setting import ExcitationOptions
from tauscope.identification import Identification, document, identify
from tauscope.identification.consistency import nearest_consistent_parameters, plausible_prior
from tauscope.identification.consistency.inequalities import LinearInequalities
from tauscope.recording import Recording
from tauscope.robot import LinkInertia, Robot, find_defect, nearest_body, read_robot, robot_from_dict, robot_to_dict


def restated(robot: Robot, link: int, **numbers: object) -> Robot:
    """The arm as its file would give it with these numbers of one link."""
    data = robot_to_dict(robot)
    data["model"]["links"][link] |= numbers
    return robot_from_dict(data)


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=5, rate_hz=50.0, periods=2, period_s=6.0)


@pytest.fixture(scope="module")
def recording(arm: SimulatedArm) -> Recording:
    return arm.recording(arm.white(0.2 * PAPER_NOISE, np.random.default_rng(1)))


@pytest.fixture(scope="module")
def sound(arm: SimulatedArm, recording: Recording) -> Identification:
    return identify(arm.robot, [recording], [recording])


WRONG = {
    "mass with the wrong sign": {"mass": -1.4},
    "inertia about the centre of mass": {"inertia": {"xx": 0, "yy": 0.01, "zz": 0.01, "xy": 0, "xz": 0, "yz": 0}},
    "moments in another order": {"inertia": {"xx": 0.4, "yy": 0.02, "zz": 0.3, "xy": 0, "xz": 0, "yz": 0}},
    "gram and millimetre": {"inertia": {"xx": 1e6, "yy": 1e7, "zz": 3e7, "xy": 0, "xz": 0, "yz": 0}},
    "products of a larger body": {"inertia": {"xx": 0.02, "yy": 0.2, "zz": 0.2, "xy": 3, "xz": 1, "yz": 0}},
    "no mass": {"mass": 0},
}


@pytest.mark.parametrize("name", WRONG)
def test_a_rich_recording_overrules_a_link_that_no_body_can_be(
    name: str, arm: SimulatedArm, recording: Recording, sound: Identification
) -> None:
    found = identify(restated(arm.robot, 1, **WRONG[name]), [recording], [recording])
    result = document(found)
    warning, *further = [each for each in result.warnings if each.code == "repaired-inertial"]
    assert [each.joint for each in further] == (["joint2"] if name == "gram and millimetre" else [])
    assert warning.joint == "joint2"
    assert "the nearest body is used" in warning.text
    assert "→" in warning.text
    assert warning.remedy
    assert result.warnings[0] == warning
    assert result.fit.held_out is not None
    assert sound.held_out is not None
    assert result.fit.held_out.relative_error < 1.02 * sound.held_out.relative_error
    data = found.posterior.learnt > 0.9999
    errors = np.sqrt(np.diag(sound.covariance)[: sound.structure.size])
    assert np.max(np.abs(found.parameters - sound.parameters)[data] / errors[data]) < 0.5
    for link in found.consistent.links:
        assert find_defect(link) is None


def test_a_diagnosis_says_it_too(arm: SimulatedArm, recording: Recording) -> None:
    wrong = restated(arm.robot, 1, mass=-1.4)
    with only_effects(["payload"]):
        found = diagnosis_document(against_model(diagnose(wrong, [recording])))
    assert [each.code for each in found.warnings] == ["repaired-inertial"]


def prior_of(robot: Robot) -> np.ndarray:
    """Standard deviations of the links' parameters before any data, (n, 10)."""
    size = 10 * robot.joint_count
    prior = plausible_prior(robot, np.zeros((1, size)), np.zeros(1))
    inverse = np.linalg.inv(prior.root)
    return np.sqrt(np.diag(inverse @ inverse.T)).reshape(-1, 10)


@pytest.mark.parametrize("mass", [-0.01, -1.4, -40.0])
def test_a_link_is_believed_less_by_the_distance_to_the_nearest_body(mass: float, arm: SimulatedArm) -> None:
    robot = restated(arm.robot, 1, mass=mass)
    unaware = prior_of(replace(robot, repairs=()))
    wide = prior_of(robot)
    np.testing.assert_array_equal(wide[[0, 2]], unaware[[0, 2]])
    assert wide[1, 6] >= abs(mass)
    (repair,) = robot.repairs
    links = list(robot.model.links or ())
    prior = plausible_prior(replace(robot, repairs=()), np.zeros((1, 30)), np.zeros(1))
    stated = np.concatenate([each.to_vector() for each in [links[0], repair.before, links[2]]])
    np.testing.assert_allclose(wide[1], unaware[1] * np.hypot(1.0, np.sqrt(prior.squared_distance(stated))))


def test_a_link_that_is_a_body_is_believed_as_before(arm: SimulatedArm) -> None:
    rounded = restated(arm.robot, 2, inertia={"xx": 0, "yy": 0.2357, "zz": 0.23575, "xy": 0, "xz": 0, "yz": 0})
    assert rounded.warnings == ()
    assert rounded.repairs == ()


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_body_is_the_conic_program_s_in_the_prior_s_metric(seed: int, arm: SimulatedArm) -> None:
    rng = np.random.default_rng(seed)
    first_moment = rng.normal(size=3) * 0.2
    spread = rng.normal(size=(3, 3)) * 0.1
    stated = LinkInertia(1.3, first_moment, spread + spread.T + 0.2 * np.eye(3))
    links = (arm.robot.model.links or ())[:2]
    robot = replace(arm.robot, model=replace(arm.robot.model, links=(*links, nearest_body(stated))))
    prior = plausible_prior(robot, np.zeros((1, 30)), np.zeros(1))
    mean = np.concatenate([*(link.to_vector() for link in links), stated.to_vector()])
    found = nearest_consistent_parameters(
        np.zeros((1, 30)), np.zeros(1), replace(prior, mean=mean), LinearInequalities.none(30)
    )
    np.testing.assert_allclose(found.links[2].to_vector(), nearest_body(stated).to_vector(), atol=2e-5)


QUICK = settings(max_examples=15, deadline=None, phases=[Phase.generate], suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize(("unit", "kept"), [(1.0, True), (1e3, True), (1e7, False)])
def test_a_body_a_hundred_times_as_large_as_the_arm_is_no_prior(
    unit: float, kept: bool, arm: SimulatedArm, recording: Recording, sound: Identification
) -> None:
    moments = {"xx": 0.05 * unit, "yy": 0.15 * unit, "zz": 0.15 * unit, "xy": 0, "xz": 0, "yz": 0}
    result = document(identify(restated(arm.robot, 1, inertia=moments), [recording], [recording]))
    warnings = [each for each in result.warnings if each.code == "repaired-inertial"]
    assert [each.joint for each in warnings] == ([] if kept else ["joint2"])
    assert result.fit.held_out is not None
    assert sound.held_out is not None
    assert result.fit.held_out.relative_error < 1.02 * sound.held_out.relative_error


@QUICK
@given(st.lists(st.floats(-1e2, 1e2), min_size=10, max_size=10))
def test_any_inertial_gives_a_result(arm: SimulatedArm, recording: Recording, vector: list[float]) -> None:
    xx, yy, zz, xy, xz, yz, mass, *first_moment = vector
    inertia = {"xx": xx, "yy": yy, "zz": zz, "xy": xy, "xz": xz, "yz": yz}
    robot = restated(arm.robot, 1, mass=mass, first_moment=first_moment, inertia=inertia)
    result = document(identify(robot, [recording]))
    is_body = find_defect(LinkInertia.from_vector(np.array(vector))) is None
    assert ("repaired-inertial" in {each.code for each in result.warnings}) != is_body
    assert result.fit.train.relative_error < 0.03


CASES = {
    "01": ("01-rounding-inertia/arm.urdf", "tool", "tool"),
    "02": ("02-inertia-without-triangle.urdf", "l2", "l1"),
}


@needs_shared_cases
@pytest.mark.parametrize("name", CASES)
def test_a_case_is_identified_and_excited(name: str, tmp_path: Path) -> None:
    file, tip, broken = CASES[name]
    urdf = SHARED_CASES / "robots" / file
    path = tmp_path / "arm.yaml"
    path.write_text(f"name: arm\nkinematics: {{urdf: {{file: {urdf}, base: base, tip: {tip}}}}}\n")
    robot = read_robot(path)
    (warning,) = robot.warnings
    assert f"inertial of link '{broken}': inertia breaks the triangle inequality" in warning.text
    simulated = simulate(robot, seed=2, rate_hz=50.0, periods=2, period_s=6.0)
    result = document(identify(robot, [simulated.recording(simulated.white(0.05, np.random.default_rng(3)))]))
    assert result.warnings[0].code == "repaired-inertial"
    assert result.fit.train.relative_error < 0.05
    limits = tuple(replace(joint, limits=replace(joint.limits, acceleration=8.0)) for joint in robot.joints)
    options = ExcitationOptions(period_s=5.0, harmonics=2, periods=1, slow_postures=0, closing_period=False, starts=1)
    assert design_excitation(replace(robot, joints=limits), options).trajectory.duration_s == 5.0
