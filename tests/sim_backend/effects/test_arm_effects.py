"""Effects of the whole arm: an arm of two point masses moves as its textbook equations, altered by hand, say."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope_sim.effects.carried_bodies import Payload, PayloadChange
from tauscope_sim.effects.external_contact import ExternalContact
from tauscope_sim.effects.friction_coupling import FrictionCoupling
from tauscope_sim.effects.geometry_errors import BaseTilt, KinematicError

Array = NDArray[np.float64]
Agree = Callable[..., dict[str, Array]]
TOLERANCE = 1e-4


def smooth_sign(v: Any, k_v: float = 500.0) -> Any:
    return np.arctan(k_v * v) / (np.pi / 2)


def planar_rates(arm: Any, extra: Callable[[float, Array, Array], Array] | None = None) -> Callable[..., Array]:
    """M(q) q̈ = u - c - g - τ_f - extra(t, q, v)."""

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v = y[:2], y[2:]
        torque = u - arm.bias(q, v) - arm.friction(v)
        if extra is not None:
            torque = torque - extra(t, q, v)
        return np.concatenate([v, np.linalg.solve(arm.mass_matrix(q), torque)])

    return rates


def test_the_arm_without_effects_follows_the_textbook(planar: Any, planar_trial: Any) -> None:
    simulated = planar_trial.simulate(planar.robot)
    expected = planar_trial.integrate(planar_rates(planar), [*planar_trial.start, 0.0, 0.0])
    np.testing.assert_allclose(simulated["link_position"], expected[:, :2], rtol=0, atol=TOLERANCE)
    np.testing.assert_array_equal(simulated["link_position"], simulated["motor_position"])


def test_payload(planar: Any, planar_trial: Any, agrees: Agree) -> None:
    """A mass at the tool is a heavier second point mass."""
    heavier = replace(planar, masses=(2.0, 1.8))
    agrees(planar.robot, [Payload(mass=0.3)], planar_trial, planar_rates(heavier), TOLERANCE)


def test_payload_away_from_the_tool_point(planar: Any, planar_trial: Any, agrees: Agree) -> None:
    """A third point mass where a longer arm would end, with a moment of inertia of its own."""
    longer = replace(planar, lengths=(0.5, 0.5))

    def rates(t: float, y: Array, u: Array) -> Array:
        q, v = y[:2], y[2:]
        _, jacobian = longer.tool(q)
        mass = planar.mass_matrix(q) + 0.3 * jacobian.T @ jacobian + 0.02 * np.ones((2, 2))
        step = 1e-6
        jacobian_rate = (longer.tool(q + step * v)[1] - longer.tool(q - step * v)[1]) / (2 * step)
        force = 0.3 * jacobian.T @ (jacobian_rate @ v - np.array(planar.gravity))
        return np.concatenate([v, np.linalg.solve(mass, u - planar.bias(q, v) - planar.friction(v) - force)])

    effect = Payload(mass=0.3, offset=[0.1, 0.0, 0.0], moments=[0.02, 0.01, 0.02])
    agrees(planar.robot, [effect], planar_trial, rates, TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize(("start", "end"), [(0.3333, None), (0.0, 0.41), (0.2, 0.5)])
def test_payload_change(start: float, end: float | None, planar: Any, planar_trial: Any, agrees: Agree) -> None:
    heavier = replace(planar, masses=(2.0, 1.8))

    def rates(t: float, y: Array, u: Array) -> Array:
        present = start <= t and (end is None or t < end)
        return planar_rates(heavier if present else planar)(t, y, u)

    # Radau finds the step in time by itself, at the price of a coarser answer
    agrees(planar.robot, [PayloadChange(mass=0.3, start=start, end=end)], planar_trial, rates, 3 * TOLERANCE)


def test_two_payloads_come_and_go_independently(planar: Any, planar_trial: Any) -> None:
    both = [PayloadChange(mass=0.3, start=0.1, end=0.3), PayloadChange(mass=0.2, start=0.2, end=0.3)]
    split = [PayloadChange(mass=0.3, start=0.1, end=0.2), PayloadChange(mass=0.5, start=0.2, end=0.3)]
    one, other = (planar_trial.simulate(planar.robot, effects)["link_position"] for effects in (both, split))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["half_sine", "rectangular"])
def test_contact_at_the_tool(profile: str, planar: Any, planar_trial: Any, agrees: Agree) -> None:
    force, start, duration = np.array([3.0, -8.0, 5.0]), 0.21, 0.33
    longer = replace(planar, lengths=(0.5, 0.45))

    def pressing(t: float, q: Array, v: Array) -> Array:
        if not start <= t < start + duration:
            return np.zeros(2)
        share = np.sin(np.pi * (t - start) / duration) if profile == "half_sine" else 1.0
        return share * longer.tool(q)[1].T @ force[:2]

    effect = ExternalContact(
        force=force.tolist(), offset=[0.05, 0.0, 0.0], start=start, duration=duration, profile=profile
    )
    agrees(planar.robot, [effect], planar_trial, planar_rates(planar, pressing), 3 * TOLERANCE)


def test_contact_of_one_joint(planar: Any, planar_trial: Any, agrees: Agree) -> None:
    def pressing(t: float, q: Array, v: Array) -> Array:
        return np.array([0.0, 2.0 * np.sin(np.pi * (t - 0.1) / 0.4)]) if 0.1 <= t < 0.5 else np.zeros(2)

    effect = ExternalContact(joint=2, torque=2.0, start=0.1, duration=0.4)
    agrees(planar.robot, [effect], planar_trial, planar_rates(planar, pressing), 3 * TOLERANCE)


def test_base_tilt(planar: Any, planar_trial: Any, agrees: Agree) -> None:
    """A base that leans about x by 0.3 feels less of gravity in its plane."""
    leaning = replace(planar, gravity=(0.0, -9.81 * np.cos(0.3)))
    agrees(planar.robot, [BaseTilt(about_x=0.3)], planar_trial, planar_rates(leaning), TOLERANCE)


def test_tilt_about_both_axes_turns_gravity(planar: Any) -> None:
    turned = BaseTilt(about_x=0.1, about_y=0.2).alter(replace(planar.robot, gravity=np.array([0.0, 0.0, -9.81])))
    expected = -9.81 * np.array([np.sin(0.2), -np.sin(0.1) * np.cos(0.2), np.cos(0.1) * np.cos(0.2)])
    np.testing.assert_allclose(turned.gravity, expected, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("link", [1, 2])
def test_link_length(link: int, planar: Any, planar_trial: Any, agrees: Agree) -> None:
    lengths = (0.53, 0.4) if link == 1 else (0.5, 0.43)
    effect = KinematicError(link=link, translation=[0.03, 0.0, 0.0])
    agrees(planar.robot, [effect], planar_trial, planar_rates(replace(planar, lengths=lengths)), TOLERANCE)


def test_link_turned_about_its_axis_shifts_the_joint(planar: Any, planar_trial: Any) -> None:
    """Link frame 1 turned by 0.1 about z: the second joint begins where it was at +0.1."""
    turned = planar_trial.simulate(planar.robot, [KinematicError(link=1, rotation=[0.0, 0.0, 0.1])])
    shifted = replace(planar_trial, start=planar_trial.start + np.array([0.0, 0.1])).simulate(planar.robot)
    np.testing.assert_allclose(turned["link_position"] + [0.0, 0.1], shifted["link_position"], rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("of", ["sum", "difference"])
def test_coupled_friction(of: str, planar: Any, planar_trial: Any, agrees: Agree) -> None:
    sign = 1.0 if of == "sum" else -1.0

    def coupling(t: float, q: Array, v: Array) -> Array:
        w = v[0] + sign * v[1]
        friction = 1.0 * smooth_sign(w) + 0.3 * w
        return np.array([friction, sign * friction])

    effect = FrictionCoupling(joint=1, other_joint=2, of=of, coulomb=1.0, viscous=0.3)
    agrees(planar.robot, [effect], planar_trial, planar_rates(planar, coupling), TOLERANCE)
