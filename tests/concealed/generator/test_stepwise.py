"""Jogs and points: within the limits, at rest between the moves, and held by friction there."""

from functools import cache

import numpy as np
import pytest

from concealed.generator import forward
from concealed.generator.arms import DRY, arm_named, noise_std
from concealed.generator.forward import Passage, physical
from concealed.generator.laws import _load, law_torque
from concealed.generator.motions import campaign
from concealed.generator.rates import RATE_HZ
from concealed.generator.stepwise import trapezoid
from concealed.generator.strength import strength
from tauscope.robot import Robot


@pytest.mark.parametrize("kind", ["jogs", "points"])
@pytest.mark.parametrize("arm", ["servo", "seven"])
def test_a_stepwise_motion_keeps_the_limits_and_rests_between_its_moves(arm: str, kind: str) -> None:
    robot = arm_named(arm)
    train, held_out = campaign(robot, 3, kind)
    assert [each.name for each in (*train, *held_out)] == ["train1", "train2", "held-out"]
    for motion in (*train, *held_out):
        position = motion.setpoints
        speed = np.diff(position, axis=0) * RATE_HZ
        moving = np.abs(speed) > 1e-9
        for number, joint in enumerate(robot.joints):
            low, high = joint.limits.position or (0.0, 0.0)
            assert low < position[:, number].min()
            assert position[:, number].max() < high
            assert np.abs(speed[:, number]).max() <= (joint.limits.velocity or 0.0)
        assert np.all(moving.any(axis=0))
        assert 0.1 < 1.0 - moving.any(axis=1).mean() < 0.8
        if kind == "jogs":
            assert moving.sum(axis=1).max() == 1
        assert np.all(np.isnan(motion.period))


def test_a_trapezoid_arrives_at_rest() -> None:
    way = trapezoid(np.linspace(0.0, 1.0, 1001), 0.2)
    speed = np.diff(way)
    assert (way[0], way[-1]) == (0.0, pytest.approx(1.0))
    assert speed.min() >= 0.0
    np.testing.assert_allclose(speed[250:750], 1e-3 / 0.8, rtol=1e-9)
    assert max(speed[0], speed[-1]) < 0.01 * speed.max()


@cache
def one_move() -> tuple[Robot, Passage]:
    """Joint 3 of the servo arm moves, the others stand still."""
    robot = arm_named("servo" + DRY)
    begin, end = np.array([0.0, 0.8, 0.2, 0.1]), np.array([0.0, 0.8, 1.1, 0.1])
    move = begin + np.multiply.outer(trapezoid(np.linspace(0.0, 1.0, 200), 0.3), end - begin)
    setpoints = np.concatenate([np.tile(begin, (100, 1)), move, np.tile(end, (100, 1))])
    return robot, forward._played(robot, (), setpoints)


def test_friction_at_rest_takes_any_value_up_to_breakaway() -> None:
    """A joint that stands still while another moves its load: the drive's torque stays, the friction takes the rest."""
    robot, made = one_move()
    assert robot.model.friction is not None
    breakaway = robot.model.friction[3].stiction
    held = np.abs(made.velocity[:, 3]) < 1e-3
    friction = (made.torque - _load(robot, made))[20:, 3][held[20:]]
    assert np.ptp(made.position[:, 3]) < 2e-3
    assert np.abs(friction).max() <= 1.02 * breakaway
    assert np.ptp(friction) > 0.1 * breakaway


def test_a_dry_arm_that_conceals_nothing_shows_nothing_where_it_moves() -> None:
    robot, made = one_move()
    whole, _ = strength(robot, [], [made], noise_std("servo" + DRY))
    assert whole < 0.2


@pytest.mark.parametrize("level", [0.03, -0.03])
def test_friction_at_rest_keeps_its_part_of_the_breakaway_that_an_effect_changes(level: float) -> None:
    robot, made = one_move()
    assert robot.model.friction is not None
    friction = robot.model.friction[3]
    (effect,) = physical(
        [{"effect": "position_dependent_friction", "joint": 4, "amplitude": level, "order": 1e-6, "phase": 0.5 * np.pi}]
    )
    more = law_torque(robot, effect, made)
    assert more is not None
    held = np.flatnonzero(np.abs(made.velocity[:, 3]) < 1e-4)[20:-20]
    before = (made.torque - _load(robot, made))[held, 3] - friction.viscous * made.velocity[held, 3]
    np.testing.assert_allclose(more[held, 3], level * before / friction.stiction, atol=0.015 * abs(level))
    assert np.abs(before + more[held, 3]).max() <= 1.02 * (friction.stiction + level)
