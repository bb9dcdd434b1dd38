"""Limits of the identification, from both of its sides."""

from dataclasses import replace

import numpy as np
import pytest

from arms import arm, dh_segment
from tauscope.dynamics import base_parameters
from tauscope.identification.consistency import plausible_prior
from tauscope.identification.dataset import Dataset, PreparedMotion, prepared_motion
from tauscope.identification.friction_shape import SEPARATION, EstimatedShape
from tauscope.identification.least_squares import JointFactor
from tauscope.identification.model_terms import choose_model
from tauscope.identification.physical_estimate import consistent_estimate
from tauscope.identification.posterior import infer
from tauscope.identification.signs import reversed_joints
from tauscope.identification.structure import JointTerms, ModelStructure
from tauscope.recording import Recording
from tauscope.recording.conditioning import AllPass, Conditioner, Motion
from tauscope.robot import FrictionShape, JointType, LinkInertia, Model, Robot

RATE_HZ = 100.0


def slider(mass: float) -> Robot:
    """A vertical slide, of which gravity and acceleration tell the mass alone."""
    robot = arm("slide", [dh_segment(0.0, 0.0, 0.3, 0.0, JointType.PRISMATIC)])
    return replace(robot, model=Model((LinkInertia(mass, np.zeros(3), 0.01 * np.eye(3)),)))


def piece(position: np.ndarray) -> PreparedMotion:
    """A motion of a slide, unfiltered, in which 1e-6 m are told from noise."""
    robot, count = slider(2.0), len(position)
    column, rows = position[:, None], np.ones((1, count, 1), dtype=bool)
    time = np.arange(count) / RATE_HZ
    motion = Motion(time, column, 0 * column, 0 * column, np.zeros((1, count, 1)), rows, RATE_HZ, AllPass(RATE_HZ))
    return prepared_motion(motion, robot, base_parameters(robot), 0, np.array([1e-6]))


def staying(rows: int) -> np.ndarray:
    """Out at a constant speed, with so many equal samples midway."""
    return np.concatenate([np.linspace(0.0, 0.99, 100), np.full(rows, 1.0), np.linspace(1.01, 2.0, 100)])


@pytest.mark.parametrize(("rows", "rests"), [(10, False), (11, True)])
def test_a_tenth_of_a_second_without_motion_is_rest(rows: int, rests: bool) -> None:
    prepared = piece(staying(rows))
    assert prepared.at_rest.any() == rests
    assert prepared.at_rest.sum() == (rows if rests else 0)


@pytest.mark.parametrize(("rows", "stops"), [(49, 0), (50, 1)])
def test_half_a_second_at_rest_is_a_stop(rows: int, stops: int) -> None:
    assert len(piece(staying(rows)).stops(0)) == stops


@pytest.mark.parametrize("part", [slice(110, None), slice(0, 130)])
def test_a_rest_that_the_edge_of_a_motion_cuts_short_is_a_stop(part: slice) -> None:
    assert len(piece(staying(40)[part]).stops(0)) == 1


@pytest.mark.parametrize(("share", "moves"), [(0.09, True), (0.11, False)])
def test_a_row_tells_of_motion_where_less_than_a_tenth_of_it_rests(share: float, moves: bool) -> None:
    prepared = piece(staying(0))
    partly = np.where(np.arange(prepared.at_rest.shape[1]) < 60, share, 0.0)[None, :]
    assert replace(prepared, at_rest=partly).moving[0, 0] == moves
    assert len(replace(prepared, at_rest=partly).stops(0)) == (not moves)


def structure_of(robot: Robot) -> ModelStructure:
    return ModelStructure(robot, base_parameters(robot), (JointTerms(100.0),) * robot.joint_count)


def weighing(mass: float, noise: float) -> JointFactor:
    """Equations of a slide that tell its mass, and that friction and offset are nothing."""
    matrix = np.vstack([np.tile(np.eye(4), (25, 1)), np.zeros((4, 4))])
    residual = np.concatenate([np.zeros(100), np.full(4, 5.0 * noise)])
    rows = np.column_stack([matrix, matrix @ [mass, 0.0, 0.0, 0.0] + residual])
    return JointFactor(np.arange(4), np.linalg.qr(rows)[1], 100)


def test_no_body_is_believed_to_more_than_all_of_itself_however_well_it_agrees() -> None:
    robot = slider(2.0)
    factor = weighing(2.0, 0.01)
    found = infer(structure_of(robot), (factor,)).prior
    stated = plausible_prior(robot, np.ones((1, 13)), np.ones(1))
    own = slice(0, 10)
    np.testing.assert_allclose(np.linalg.inv(found.root[own, own]), 2.0 * np.linalg.inv(stated.root[own, own]))


def test_a_link_s_mass_may_lie_anywhere_along_it() -> None:
    prior = plausible_prior(slider(2.0), np.ones((1, 13)), np.ones(1))
    spread = np.linalg.inv(prior.root[:10, :10])
    std = np.sqrt(np.diag(spread @ spread.T))
    assert std[6] == pytest.approx(2.0)
    np.testing.assert_allclose(std[7:], 2.0 * 0.3 / np.sqrt(2.0))


def test_no_link_weighs_less_than_a_tenth_of_what_is_believed() -> None:
    structure = structure_of(slider(2.0))
    factor, target = 1e4 * np.eye(4), np.array([-1e4, 0.0, 0.0, 0.0])
    prior = plausible_prior(structure.robot, np.ones((1, 13)), np.ones(1))
    assert consistent_estimate(structure, factor, target, prior).links[0].mass == pytest.approx(0.2, rel=1e-4)


@pytest.mark.parametrize(("share", "known"), [(0.94, True), (0.96, False)])
def test_a_slope_at_the_limit_of_its_range_is_open(share: float, known: bool) -> None:
    shape = EstimatedShape(400.0, share * 400.0 / SEPARATION, True, True, False, False)
    assert (shape.open_at_limit() == shape) == known
    assert shape.open_at_limit().delta_identifiable == known
    given = replace(shape, delta_given=True)
    assert given.open_at_limit() == given


def swinging() -> tuple[Robot, Recording]:
    """A slide that swings, with friction, and its torque with the wrong sign."""
    robot = slider(2.0)
    robot = replace(robot, joints=(replace(robot.joints[0], friction_shape=FrictionShape(400.0)),))
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    q = 0.4 * np.sin(2.0 * time) + 0.1 * np.sin(5.1 * time)
    qd = 0.8 * np.cos(2.0 * time) + 0.51 * np.cos(5.1 * time)
    qdd = -1.6 * np.sin(2.0 * time) - 2.601 * np.sin(5.1 * time)
    torque = 2.0 * (qdd + 9.81) + 3.0 * np.tanh(300.0 * qd) + rng.normal(0.0, 8.0, len(time))
    return robot, Recording.from_arrays("swing", time, q[:, None], -torque[:, None])


@pytest.mark.parametrize(("ratio", "turned"), [(1.19, ()), (1.21, (0,))])
def test_another_sign_is_tried_where_the_residual_is_coloured(ratio: float, turned: tuple[int, ...]) -> None:
    robot, recording = swinging()
    base = base_parameters(robot)
    motions = Dataset([Conditioner.survey(recording, robot)], robot, base, None)
    structure, _, factors = choose_model(motions, robot, base, rotor_inertia=False)
    posterior = infer(structure, factors)
    consistent = consistent_estimate(structure, posterior.factor, posterior.target, posterior.prior)
    unlucky = replace(consistent, squared_residual=consistent.free_squared_residual)
    assert reversed_joints(motions, structure, factors, np.array([ratio]), posterior, unlucky) == turned
