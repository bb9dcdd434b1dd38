"""Gradients by the Fourier coefficients against finite differences, and predictions against Pinocchio."""

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest

from arms import dh_segment
from excitation.excited_arms import (
    Array,
    derivative_along,
    gradient_arms,
    limited_paper_arm,
    modelled_arm,
    rest_error,
    resting_series,
)
from pinocchio_arm import pinocchio_model
from tauscope.dynamics import base_parameters, torque_regressor
from tauscope.dynamics.friction import friction_columns
from tauscope.excitation import Box, Criterion, Workspace
from tauscope.excitation.constraints import KinematicUsage, StateUsage, smooth_maximum
from tauscope.excitation.information import ExcitationRegressor, MotionGradient, criterion_value
from tauscope.excitation.problem import ExcitationProblem, Objective
from tauscope.excitation.series_space import SeriesSpace
from tauscope.excitation.torque_prediction import TorquePrediction
from tauscope.excitation.workspace import WorkspaceUsage
from tauscope.robot import Robot
from tauscope.robot.kinematics import link_placements
from tauscope.trajectory import MotionSamples, motion_limits
from tauscope.trajectory.servo_bounds import TorqueBounds, servo_bounds

ARMS = gradient_arms()
IDS = ["paper", "ur5", "panda", "random3", "random4"]
SAMPLES = 60


def coefficients(robot: Robot, seed: int = 0) -> tuple[SeriesSpace, Array]:
    space = SeriesSpace(motion_limits(robot), 10.0, 5)
    x = np.random.default_rng(seed).normal(scale=0.35, size=(robot.joint_count, space.columns))
    x[:, 0] *= 0.5
    return space, x


def problem(robot: Robot, criterion: Criterion, workspace: Workspace | None = None) -> tuple[ExcitationProblem, Array]:
    space, x = coefficients(robot)
    limits, base = motion_limits(robot), base_parameters(robot)
    noise = np.random.default_rng(1).uniform(0.2, 1.0, robot.joint_count)
    regressor = ExcitationRegressor(robot, base, capacity=SAMPLES, noise_std=noise, steepest=np.full(len(noise), 12.0))
    scaling = np.random.default_rng(2).uniform(0.5, 2.0, regressor.column_count)
    damping = np.outer([0.0, 3.0], np.ones_like(noise))  # the second bound is that of a servo with back-EMF
    bounds = TorqueBounds(("torque", "voltage"), np.stack([0.5 * limits.torque, 0.6 * limits.torque]), damping)
    torque = TorquePrediction(robot, base, regressor, limits.velocity, bounds)
    obstacles = None if workspace is None else WorkspaceUsage(robot, workspace)
    made = ExcitationProblem(
        space,
        space.grid(SAMPLES),
        space.grid(4 * SAMPLES),
        Objective(criterion, regressor, scaling),
        KinematicUsage(space, limits),
        StateUsage(torque, obstacles),
    )
    return made, x.ravel()


@pytest.mark.parametrize("robot", ARMS, ids=IDS)
@pytest.mark.parametrize("criterion", list(Criterion))
def test_the_criterion_s_gradient(robot: Robot, criterion: Criterion) -> None:
    made, x = problem(robot, criterion)
    found = made.gradient(x)
    rng = np.random.default_rng(5)
    for _ in range(4):
        way = rng.normal(size=len(x))
        way /= np.linalg.norm(way)
        expected = derivative_along(made.cost, x, way, 1e-3)
        assert float(found @ way) == pytest.approx(expected, rel=1e-6, abs=1e-6 * float(np.linalg.norm(found)))


@pytest.mark.parametrize("robot", ARMS, ids=IDS)
def test_every_constraint_s_gradient(robot: Robot) -> None:
    workspace = Workspace(
        -0.2, (Box(np.array([0.2, 0.2, -0.2]), np.array([0.5, 0.5, 0.3])),), np.array([0.0, 0.1, 0.2])
    )
    made, x = problem(robot, Criterion.COND_F, workspace)
    made.calibrate(x)
    found = made.jacobian(x)
    assert found.shape == (3 * robot.joint_count + 2, len(x))
    rng = np.random.default_rng(6)
    way = rng.normal(size=len(x))
    way /= np.linalg.norm(way)
    for row, gradient in enumerate(found):
        # The box's nearest face may change: a small step, and the accuracy that it leaves.
        step, tolerance = (1e-6, 1e-4) if row == len(found) - 1 else (1e-5, 1e-6)
        expected = derivative_along(lambda y, row=row: float(made.constraints(y)[row]), x, way, step)
        size = max(float(np.linalg.norm(gradient)), 1e-6)
        assert float(gradient @ way) == pytest.approx(expected, rel=tolerance, abs=tolerance * size)


def test_calibrated_constraints_are_exact() -> None:
    robot = limited_paper_arm()
    made, x = problem(robot, Criterion.COND_F)
    made.calibrate(x)
    space, _ = coefficients(robot)
    series = space.series(x.reshape(made.shape))
    fine = series.evaluate(np.arange(20_000.0) * (10.0 / 20_000))
    limits = motion_limits(robot)
    values = 1.0 - made.constraints(x)
    np.testing.assert_allclose(values[3:6], np.abs(fine.velocity).max(axis=0) / limits.velocity, rtol=5e-3)
    np.testing.assert_allclose(values[6:9], np.abs(fine.acceleration).max(axis=0) / limits.acceleration, rtol=5e-3)
    assert (values[3:6] >= np.abs(fine.velocity).max(axis=0) / limits.velocity - 1e-12).all()


def test_the_smooth_maximum_is_one_and_has_its_gradient() -> None:
    usage = np.random.default_rng(3).uniform(0.0, 1.0, (40, 3))
    values, weights = smooth_maximum(usage)
    assert (values <= usage.max(axis=0)).all()
    assert (values >= 0.85 * usage.max(axis=0)).all()
    way = np.random.default_rng(4).normal(size=usage.shape) * 1e-2
    expected = derivative_along(lambda u: float(smooth_maximum(u)[0].sum()), usage, way, 1e-2)
    assert float((weights * way).sum()) == pytest.approx(expected, rel=1e-6)


def test_the_regressor_has_identification_s_columns() -> None:
    robot = limited_paper_arm()
    base = base_parameters(robot)
    motion = resting_series(np.random.default_rng(0), 3).evaluate(np.linspace(0.0, 10.0, 33))
    found = ExcitationRegressor(robot, base, capacity=33).stacked(motion)
    phi = torque_regressor(robot, motion.position, motion.velocity, motion.acceleration)
    expected = np.zeros((3 * 33, len(base.independent_columns) + 12))
    for joint in range(3):
        rows = slice(33 * joint, 33 * (joint + 1))
        expected[rows, : len(base.independent_columns)] = phi[:, joint, base.independent_columns]
        first = len(base.independent_columns) + 4 * joint
        shape = robot.joints[joint].friction_shape
        expected[rows, first : first + 4] = friction_columns(motion.velocity[:, joint], shape)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    gram = found.T @ found / 33
    regressor = ExcitationRegressor(robot, base, capacity=33)
    np.testing.assert_allclose(regressor.information(regressor.rows(motion)), gram, atol=1e-12)
    assert criterion_value(Criterion.COND_2, gram).condition_number == pytest.approx(np.linalg.cond(found), rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_predicted_torque_is_pinocchio_s_plus_friction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = modelled_arm(rng, 2 + seed)
    limits, base = motion_limits(robot), base_parameters(robot)
    regressor = ExcitationRegressor(robot, base, capacity=50)
    bounds = servo_bounds(robot).with_limit(limits.torque)
    prediction = TorquePrediction(robot, base, regressor, limits.velocity, bounds)
    motion = resting_series(rng, robot.joint_count).evaluate(np.linspace(0.0, 10.0, 50))
    assert robot.model.links is not None
    assert robot.model.friction is not None
    model = pinocchio_model(robot, np.concatenate([link.to_vector() for link in robot.model.links]))
    data = model.createData()
    states = zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    rigid = np.array([pinocchio.rnea(model, data, *state) for state in states])
    found = prediction.torque(motion)
    level = np.array([max(f.stiction, f.stiction + f.stribeck) for f in robot.model.friction])
    viscous = np.array([f.viscous for f in robot.model.friction])
    expected = np.abs(rigid) + level + viscous * np.abs(motion.velocity)
    # Rounded where it is zero, by no more than a hundredth of the limit, and never below the truth.
    assert (found >= expected - 1e-9).all()
    assert (found <= expected + 0.011 * limits.torque).all()


def test_clearance_is_where_the_kinematics_put_the_points() -> None:
    rng = np.random.default_rng(8)
    robot = modelled_arm(rng, 4)
    tool = np.array([0.1, -0.2, 0.3])
    box = Box(np.array([-0.3, -0.2, 0.1]), np.array([0.4, 0.5, 0.6]))
    usage = WorkspaceUsage(robot, Workspace(-0.1, (box,), tool))
    q = rng.uniform(-1.0, 1.0, (30, 4))
    frames = link_placements(robot, q)
    tip = frames[:, -1, :3, :3] @ tool + frames[:, -1, :3, 3]
    clearance = usage.clearance(q)
    names = usage.names
    np.testing.assert_allclose(clearance[:, names.index("the tool and the floor")], tip[:, 2] + 0.1, atol=1e-12)
    outside = np.maximum(np.maximum(box.low - tip, tip - box.high), 0.0)
    inside = ((tip > box.low) & (tip < box.high)).all(axis=1)
    found = clearance[:, names.index("the tool and box 1")]
    assert np.array_equal(found < 0.0, inside)
    np.testing.assert_allclose(found[~inside], outside[~inside].max(axis=1), atol=1e-12)


def test_points_that_stand_still_are_nobody_s_choice() -> None:
    robot = limited_paper_arm()
    names = WorkspaceUsage(robot, Workspace(0.0)).names
    # Joint 1's origin and joint 2's, above it on the same axis, cannot move.
    assert names == ("the end of link 2 and the floor", "the tool and the floor")
    assert dh_segment(0.0, 0.3, 0.0, np.pi / 2).after.translation[2] == 0.3


def test_a_vector_and_its_series_are_the_same() -> None:
    robot = ARMS[1]
    space, x = coefficients(robot)
    series = space.series(x)
    limits = motion_limits(robot)
    speed = limits.velocity[:, None]
    parts = (series.cosine / speed @ space._cosine, series.sine / speed @ space._sine)
    np.testing.assert_allclose(np.column_stack([(series.centre - limits.middle) / limits.half_range, *parts]), x)
    assert max(rest_error(series)) < 1e-13
    on_grid = space.grid(50).motion(x)
    exact = series.evaluate(np.arange(50.0) * 0.2)
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(on_grid, name), getattr(exact, name), atol=1e-12)
    rng = np.random.default_rng(0)
    parts = [rng.normal(size=(50, robot.joint_count)) for _ in range(3)]
    back = space.grid(50).pull_back(MotionGradient(*parts))

    def pairing(vector: Array) -> float:
        motion = space.grid(50).motion(vector)
        samples = MotionSamples(motion.position, motion.velocity, motion.acceleration)
        return float(
            sum(
                (p * getattr(samples, n)).sum()
                for p, n in zip(parts, ("position", "velocity", "acceleration"), strict=True)
            )
        )

    way = rng.normal(size=x.shape)
    assert float((back * way).sum()) == pytest.approx(pairing(x + way) - pairing(x), rel=1e-9)
