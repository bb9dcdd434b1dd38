"""Designs: limits kept on a finer grid, better than random motions, and refused where nothing is possible."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from arms import random_link, ur5_like
from excitation.excited_arms import assert_within_limits, limited_paper_arm, modelled_arm, short_search, with_limits
from tauscope.dynamics import base_parameters
from tauscope.errors import ExcitationError
from tauscope.excitation import (
    Box,
    ColumnScaling,
    Criterion,
    ExcitationDesign,
    ExcitationOptions,
    OptimiserProgress,
    Workspace,
    design_excitation,
)
from tauscope.excitation.information import ExcitationRegressor
from tauscope.excitation.workspace import WorkspaceUsage
from tauscope.robot import JointLimits, Model, Robot
from tauscope.robot.kinematics import link_placements
from tauscope.trajectory import trajectory_json

QUICK = ExcitationOptions(starts=1, slow_postures=1)


@pytest.fixture(scope="module", autouse=True)
def _short_search() -> Iterator[None]:
    with short_search():
        yield


LIMITS = {
    "seed": st.integers(0, 2**32 - 1),
    "joints": st.integers(1, 3),
    "low": st.floats(-2.5, -0.2),
    "high": st.floats(0.1, 2.5),
    "speed": st.floats(0.2, 3.0),
    "acceleration": st.floats(0.5, 20.0),
    "torque": st.floats(20.0, 300.0),
    "period": st.floats(4.0, 20.0),
}


@pytest.mark.slow
@settings(max_examples=3, suppress_health_check=[HealthCheck.too_slow])
@given(**LIMITS)
def test_random_limits_hold_at_every_instant(**drawn: Any) -> None:
    check_random_limits(**drawn)


@pytest.mark.proof
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(**LIMITS)
def test_many_random_limits_hold_at_every_instant(**drawn: Any) -> None:
    check_random_limits(**drawn)


def check_random_limits(
    seed: int, joints: int, low: float, high: float, speed: float, acceleration: float, torque: float, period: float
) -> None:
    robot = modelled_arm(np.random.default_rng(seed), joints)
    robot = with_limits(robot, JointLimits((low, high), speed, acceleration, torque))
    options = replace(QUICK, period_s=period, periods=1, limit_fraction=1.0)
    try:
        design = design_excitation(robot, options)
    except ExcitationError as error:
        refused = str(error)  # gravity alone may need more than a torque limit that was drawn
        assume("torque" not in refused and "motion" not in refused)
        raise
    assert_within_limits(robot, design, options)
    margins = design.margins
    assert min(part.min() for part in (margins.position, margins.velocity, margins.acceleration)) >= -1e-9


@cache
def plain() -> ExcitationDesign:
    return design_excitation(limited_paper_arm(), QUICK)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_motion() -> None:
    first, second = plain(), design_excitation(limited_paper_arm(), QUICK)
    assert trajectory_json(first.trajectory) == trajectory_json(second.trajectory)
    other = design_excitation(limited_paper_arm(), replace(QUICK, seed=4))
    assert trajectory_json(first.trajectory) != trajectory_json(other.trajectory)


def test_progress_grows_to_its_end() -> None:
    told: list[OptimiserProgress] = []
    design_excitation(limited_paper_arm(), QUICK, progress=told.append)
    fractions = [each.fraction for each in told]
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] <= fractions[-1] <= 1.0
    bests = [each.best for each in told]
    assert bests[-1] < bests[1]


@pytest.mark.slow
@pytest.mark.parametrize("criterion", list(Criterion))
def test_every_criterion_gets_better_where_it_is_asked_for(criterion: Criterion) -> None:
    design = (
        plain()
        if criterion is QUICK.criterion
        else design_excitation(limited_paper_arm(), replace(QUICK, criterion=criterion))
    )
    assert design.value < design.random_value
    robot = limited_paper_arm()
    matrix = ExcitationRegressor(robot, base_parameters(robot), capacity=2000).stacked(
        design.series.evaluate(np.arange(2000.0) * 0.005)
    )
    gram = matrix.T @ matrix / 2000
    expected = {
        Criterion.COND_F: np.linalg.norm(gram) * np.linalg.norm(np.linalg.inv(gram)),
        Criterion.LOG_DET: -np.linalg.slogdet(gram)[1] / len(gram),
        Criterion.COND_2: np.linalg.cond(matrix),
    }
    assert design.value == pytest.approx(expected[criterion], rel=1e-5)


def test_noise_and_scaling_change_the_motion() -> None:
    robot = limited_paper_arm()
    weighted = design_excitation(robot, replace(QUICK, noise_std=np.array([0.05, 5.0, 0.5])))
    scaled = design_excitation(robot, replace(QUICK, scaling=ColumnScaling.TYPICAL))
    assert weighted.value != pytest.approx(plain().value, rel=1e-3)
    assert scaled.value < 0.1 * plain().value  # columns of one size are far better conditioned
    with pytest.raises(ExcitationError, match="noise_std needs 3 positive numbers"):
        design_excitation(robot, replace(QUICK, noise_std=np.array([1.0, 0.0, 1.0])))


@pytest.mark.slow
def test_floor_and_box_are_kept_clear() -> None:
    robot = limited_paper_arm()
    workspace = Workspace(0.1, (Box(np.array([0.3, -2.0, 0.0]), np.array([1.5, -0.2, 2.0])),))
    options = replace(QUICK, workspace=workspace, periods=2)
    design = design_excitation(robot, options)
    assert_within_limits(robot, design, options)
    samples = design.trajectory.samples(1000.0)
    ends = link_placements(robot, samples.position)[:, 1:, :3, 3]
    assert ends[..., 2].min() >= 0.1
    box = workspace.boxes[0]
    assert not ((ends > box.low) & (ends < box.high)).all(axis=-1).any()
    assert design.margins.workspace_m is not None
    assert (
        0.0 <= design.margins.workspace_m <= WorkspaceUsage(robot, workspace).clearance(samples.position).min() + 1e-3
    )


@pytest.mark.slow
def test_a_tight_torque_limit_is_kept() -> None:
    robot = limited_paper_arm(torque=11.0)
    design = design_excitation(robot, QUICK)
    assert_within_limits(robot, design, QUICK)
    assert design.margins.drive["torque"].min() >= 0.0
    free = design_excitation(limited_paper_arm(torque=None), QUICK)
    with pytest.raises(AssertionError):  # the limit binds: without it the motion asks for more
        assert_within_limits(robot, free, QUICK)


def test_a_robot_without_limits_or_model_says_what_was_assumed() -> None:
    robot = ur5_like()
    design = design_excitation(robot, replace(QUICK, periods=1, slow_postures=0, closing_period=False))
    notes = "\n".join(design.notes)
    assert "joint1: position assumed within ±3.142 rad" in notes
    assert "joint6: velocity assumed up to 1 rad/s" in notes
    assert "acceleration assumed up to 4 rad/s²" in notes
    assert "torque is not constrained: the robot file has no model" in notes
    assert not design.margins.drive
    modelled = replace(robot, model=Model(tuple(random_link(np.random.default_rng(j)) for j in range(6))))
    design = design_excitation(modelled, replace(QUICK, periods=1, slow_postures=0, closing_period=False))
    assert "no limit is stated" in "\n".join(design.notes)


def changed(joint: int, **limits: object) -> Robot:
    """The paper's arm with other limits of one joint."""
    robot = limited_paper_arm()
    joints = list(robot.joints)
    joints[joint] = replace(joints[joint], limits=replace(joints[joint].limits, **limits))
    return replace(robot, joints=tuple(joints))


@pytest.mark.parametrize(
    ("robot", "options", "message"),
    [
        (changed(1, position=(0.5, 0.5001)), {}, "joint2: position limits .* leave no room to move"),
        (changed(2, velocity=0.0), {}, "joint3: a velocity limit of 0 rad/s allows no motion"),
        (changed(0, acceleration=0.0), {}, "joint1: an acceleration limit of 0 rad/s² allows no motion"),
        (changed(1, position=(-0.4, 0.4), torque=0.5), {}, "joint2: torque limit: at rest the prior model needs"),
        (changed(1, torque=0.0), {}, "joint2: torque limit 0 less the margin leaves 0"),
        (
            limited_paper_arm(),
            {"workspace": Workspace(2.0)},
            "workspace: the end of link 2 and the floor meet in every posture, by 1.2 m",
        ),
        (
            limited_paper_arm(),
            {"workspace": Workspace(None, (Box(-3.0 * np.ones(3), 3.0 * np.ones(3)),))},
            "and box 1 meet in every posture",
        ),
    ],
)
def test_what_cannot_be_is_refused_by_name(robot: Robot, options: dict[str, object], message: str) -> None:
    with pytest.raises(ExcitationError, match=message) as raised:
        design_excitation(robot, replace(QUICK, **options))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "options",
    [
        {"period_s": 0.0},
        {"period_s": np.nan},
        {"harmonics": 1},
        {"periods": 0},
        {"limit_fraction": 1.5},
        {"torque_margin": 1.0},
        {"starts": 0},
        {"seed": -1},
        {"slow_postures": -1},
    ],
)
def test_wishes_that_mean_nothing(options: dict[str, object]) -> None:
    with pytest.raises(ExcitationError, match=f"{next(iter(options))} is "):
        replace(QUICK, **options)


def test_boxes_that_are_none() -> None:
    with pytest.raises(ExcitationError, match="the lower one first"):
        Box(np.ones(3), np.zeros(3))
    with pytest.raises(ExcitationError, match="give a height"):
        Workspace(np.nan)
