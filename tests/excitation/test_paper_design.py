"""The paper's arm with default options: the whole trajectory, and how good it is."""

import numpy as np
import pytest

from excitation.excited_arms import assert_within_limits, limited_paper_arm
from tauscope.dynamics import base_parameters
from tauscope.excitation import (
    ExcitationDesign,
    ExcitationOptions,
    design_excitation,
    excitation_document,
    require_within_limits,
)
from tauscope.excitation.information import ExcitationRegressor
from tauscope.robot import Robot
from tauscope.trajectory import FourierSegment, MotionSamples, motion_limits, parse_trajectory_json, trajectory_json
from tauscope_sim.motion import random_fourier_motion

TIME = np.arange(500.0) * 0.02


@pytest.fixture(scope="module")
def paper_design() -> ExcitationDesign:
    """The paper's arm with default options."""
    return design_excitation(limited_paper_arm())


def condition_number(robot: Robot, motion: MotionSamples) -> float:
    """Of L at these samples, by NumPy."""
    return float(np.linalg.cond(ExcitationRegressor(robot, base_parameters(robot), capacity=4096).stacked(motion)))


@pytest.mark.slow
def test_the_paper_s_arm(paper_design: ExcitationDesign) -> None:
    robot = limited_paper_arm()
    assert_within_limits(robot, paper_design, ExcitationOptions())
    found = condition_number(robot, paper_design.series.evaluate(TIME))
    assert paper_design.condition_number == pytest.approx(found, rel=0.02)
    rng = np.random.default_rng(0)
    for _ in range(100):
        drawn = random_fourier_motion(robot.joints, rng, limit_fraction=0.95).evaluate(TIME)
        motion = MotionSamples(drawn.position, drawn.velocity, drawn.acceleration)
        assert found < condition_number(robot, motion)
    assert paper_design.value < paper_design.random_value


def test_the_whole_trajectory(paper_design: ExcitationDesign) -> None:
    trajectory = paper_design.trajectory
    ends = trajectory.evaluate(np.array([0.0, trajectory.duration_s]))
    assert np.abs(ends.velocity).max() < 1e-9
    assert np.abs(ends.acceleration).max() < 1e-9
    np.testing.assert_allclose(ends.position[0], ends.position[1], atol=1e-9)
    samples = trajectory.samples(100.0)
    labels = [np.flatnonzero(samples.period == k) for k in range(6)]
    assert [len(rows) for rows in labels] == [1000] * 6
    for rows in labels[1:]:
        np.testing.assert_allclose(samples.position[rows], samples.position[labels[0]], atol=1e-9)
    require_within_limits(trajectory, limited_paper_arm(), motion_limits(limited_paper_arm()))
    jerk = np.abs(np.diff(trajectory.samples(1000.0).acceleration, axis=0)).max() * 1000.0
    assert jerk < 100.0


def test_every_joint_reverses_slowly_at_several_postures(paper_design: ExcitationDesign) -> None:
    trajectory = paper_design.trajectory
    slow = [s for s in trajectory.segments if isinstance(s, FourierSegment) and s.first_period is None]
    assert len(slow) == 3
    postures, speeds = [], []
    for segment in slow:
        motion = segment.evaluate(np.linspace(0.0, segment.duration_s, 4001))
        for joint in range(3):
            moving = motion.velocity[np.abs(motion.velocity[:, joint]) > 1e-6, joint]
            assert np.count_nonzero(np.diff(np.sign(moving))) >= 4
        postures.append(motion.position[0])
        speeds.append(np.abs(motion.velocity).max())
    assert max(speeds) <= 0.1
    assert max(speeds) > 3.0 * min(speeds)
    assert min(np.abs(postures[a] - postures[b]).max() for a, b in ((0, 1), (1, 2), (0, 2))) > 0.3


def test_the_document_holds_the_trajectory_and_can_be_played(paper_design: ExcitationDesign) -> None:
    text = excitation_document(paper_design).model_dump_json(by_alias=True)
    assert '"schema":"tauscope.excitation/1"' in text
    played = parse_trajectory_json(text, "design.json", limited_paper_arm())
    assert trajectory_json(played) == trajectory_json(paper_design.trajectory)
    document = excitation_document(paper_design)
    assert document.condition_number == paper_design.condition_number
    assert set(document.margins) == {"position", "velocity", "acceleration", "torque"}
    assert document.history
    assert document.active
