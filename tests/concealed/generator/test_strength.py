"""The measure of an effect's strength: nothing where nothing is concealed, in proportion to what is."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from concealed.generator.arms import NOISE_STD, arm_named, without_truth
from concealed.generator.forward import Passage, physical
from concealed.generator.laws import law_torque, with_law
from concealed.generator.motions import fourier_campaign
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.strength import Reference, Sight, strength
from tauscope.dynamics import inverse_dynamics
from tauscope_sim.friction import static_friction_torque

COGGING = {"effect": "cogging", "joint": 1, "amplitude": 0.3, "order": 17.0, "phase": 0.4}


@cache
def passage(arm: str) -> Passage:
    """A motion followed exactly, with the torque that it takes by our own inverse dynamics."""
    robot = arm_named(arm)
    train, _ = fourier_campaign(robot, 3)
    time = np.arange(round(8.0 * FINE * RATE_HZ)) / (FINE * RATE_HZ)
    exact = train[0].series.evaluate(time)
    links = np.concatenate([link.to_vector() for link in robot.model.links or ()])
    torque = inverse_dynamics(robot, links, exact.position, exact.velocity, exact.acceleration)
    shapes = [joint.friction_shape for joint in robot.joints]
    torque = torque + static_friction_torque(exact.velocity, robot.model.friction or (), shapes)
    return Passage(exact.position, exact.velocity, torque)


@pytest.mark.parametrize("arm", ["paper", "six", "seven"])
def test_an_arm_that_conceals_nothing_shows_nothing(arm: str) -> None:
    whole, _ = strength(arm_named(arm), [], [passage(arm)], NOISE_STD[arm])
    assert whole < 0.2


def test_it_grows_in_proportion_and_stays_at_its_joint() -> None:
    robot, noise = arm_named("paper"), NOISE_STD["paper"]
    made = [
        with_law(robot, physical([{**COGGING, "amplitude": amplitude}]), passage("paper")) for amplitude in (0.3, 0.9)
    ]
    found = [strength(robot, [], [each], noise) for each in made if each is not None]
    assert found[1][0] == pytest.approx(3.0 * found[0][0], rel=0.01)
    assert found[0][1][0] > 0.98 * found[0][0]
    # Far from what any nominal column can follow, s is the torque's own norm over the noise's.
    torque = law_torque(robot, physical([COGGING])[0], passage("paper"))
    assert torque is not None
    plain = np.linalg.norm(torque[::FINE, 0]) / noise[0]
    assert 0.8 * plain < found[0][0] <= plain


def test_half_the_noise_is_twice_the_strength_and_what_is_foreseen_comes_true() -> None:
    robot, noise = arm_named("paper"), np.array(NOISE_STD["paper"])
    made = with_law(robot, physical([COGGING]), passage("paper"))
    assert made is not None
    whole, _ = strength(robot, [], [made], noise)
    assert strength(robot, [], [made], 0.5 * noise)[0] == pytest.approx(2.0 * whole)
    assert sight().foreseen(COGGING) == pytest.approx(whole, rel=1e-6)


@pytest.mark.parametrize(
    "entry",
    [
        {"effect": "viscous_friction", "joint": 2, "coefficient": 0.4},
        {"effect": "torque_offset", "joint": 2, "torque": 3.0},
    ],
)
def test_what_the_nominal_model_has_itself_does_not_show(entry: dict[str, Any]) -> None:
    assert sight().foreseen(entry) < 0.2


def sight() -> Sight:
    return Sight(arm_named("paper"), [passage("paper")], NOISE_STD["paper"])


def test_correlated_noise_hides_what_is_slow_and_half_the_samples_hide_alike() -> None:
    spring = {"effect": "joint_spring", "joint": 2, "stiffness": 3.0}
    robot, seen, noise = arm_named("paper"), [passage("paper")], NOISE_STD["paper"]
    good = sight().foreseen(spring)
    half = Sight(robot, seen, noise, Reference(every=2)).foreseen(spring)
    slow = Sight(robot, seen, noise, Reference(correlation=0.95)).foreseen(spring)
    assert half == pytest.approx(good / np.sqrt(2.0), rel=0.05)
    # At frequencies far below the noise's corner its power is (1 + ρ) / (1 - ρ) times that of white noise.
    assert good / np.sqrt(39.0) < slow < 0.6 * good


def test_rest_under_dry_friction_shows_nothing() -> None:
    """A cogging torque at a place where the joint stands still is one with the friction that holds it."""
    robot = arm_named("paper-dry")
    still = Passage(np.full((8000, 3), 0.3), np.full((8000, 3), 3e-6), np.zeros((8000, 3)))
    looking = Sight(robot, [still, passage("paper")], NOISE_STD["paper"])
    bump = np.zeros((8000, 3))
    bump[3000:4000, 1] = 5.0
    assert looking.strength([bump, np.zeros_like(passage("paper").torque)])[0] == 0.0


def test_what_a_sensor_changes_counts_in_the_band_alone() -> None:
    robot, noise, made = arm_named("paper"), NOISE_STD["paper"], passage("paper")
    late = [{"effect": "time_delay", "joint": 2, "delay": 0.004}]
    time = np.arange(len(made.torque)) / (FINE * RATE_HZ)
    humming = replace(made, torque=made.torque + 10.0 * np.array(noise) * np.sin(2.0 * np.pi * 60.0 * time)[:, None])
    whole, by_joint = strength(robot, late, [humming], noise)
    assert whole == pytest.approx(strength(robot, late, [made], noise)[0], rel=0.02)
    assert by_joint[1] > 0.9 * whole


def test_the_robot_file_of_a_trial_says_nothing_of_the_truth() -> None:
    robot = without_truth(arm_named("six"), states_friction=False)
    assert robot.model.links is None
    assert robot.model.friction is None
    assert all(joint.friction_shape.k_v is None for joint in robot.joints)
