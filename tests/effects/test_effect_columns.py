"""Columns of the effects against references written out again, sample by sample where there is a state."""

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest

from effects.piece_of_motion import K_V, RATE, SIGNALS, Array, context, torque
from pinocchio_arm import pinocchio_model
from tauscope.effects import Effect, possible_effects
from tauscope.effects.deflection import FIRST_ORDER, inertia_of_link, torque_of_deflection
from tauscope.effects.joint_elasticity import DAMPING, transmitted
from tauscope.effects.time_delay import Lag, Shift
from tauscope.robot import JointType

STEPS = 20


def form(effect: str, joint: int | None, number: int = 0) -> Effect:
    found = [each for each in possible_effects(context()) if each.id == effect and each.joint == joint]
    return found[number]


def columns(effect: str, joint: int | None, shape: tuple[float, ...] = (), number: int = 0) -> Array:
    """Columns of one shape, (c, m, N) or (c, m, P, N)."""
    return form(effect, joint, number).columns(SIGNALS, np.array([shape]).reshape(1, -1))[0]


V, Q, A, L, T = (getattr(SIGNALS, name)[2] for name in ("velocity", "position", "acceleration", "load", "torque"))
S = SIGNALS.step[2]


@pytest.mark.parametrize(
    ("effect", "shape", "expected"),
    [
        ("asymmetric_coulomb", (), [np.where(V > 0, S, -S)]),
        ("asymmetric_viscous", (), [np.where(V > 0, V, -V)]),
        ("nonlinear_viscous", (2.2,), [np.where(V > 0, 1, -1) * np.exp(2.2 * np.log(np.abs(V)))]),
        ("load_dependent_friction", (), [S * np.sqrt(L**2)]),
        ("position_dependent_friction", (1.0,), [S * np.cos(Q), S * np.sin(Q)]),
        ("position_dependent_friction", (2.0,), [S * (1.0 - 2.0 * np.sin(Q) ** 2), 2.0 * S * np.sin(Q) * np.cos(Q)]),
        ("stribeck_friction", (0.2, 2.0), [S / np.exp((V / 0.2) ** 2)]),
        ("stribeck_friction", (0.2, 1.0), [S / np.exp(np.abs(V) / 0.2)]),
        ("cogging", (21.0,), [np.imag(np.exp(21j * Q)), np.real(np.exp(21j * Q))]),
        ("torque_ripple", (21.0,), [L * np.imag(np.exp(21j * Q)), L * np.real(np.exp(21j * Q))]),
        ("joint_spring", (), [Q]),
        ("rotor_inertia", (), [A]),
        ("torque_gain_error", (), [T]),
        ("torque_saturation", (5.0,), [-(T - 5.0 * (1.0 - 2.0 / (np.exp(T / 2.5) + 1.0)))]),
    ],
)
def test_columns_that_need_no_state(effect: str, shape: tuple[float, ...], expected: list[Array]) -> None:
    found = columns(effect, 2, shape)
    assert found.shape == (len(expected), 1, len(V))
    assert found[:, 0] == pytest.approx(np.array(expected), abs=1e-12)


def test_friction_varies_by_whole_waves_a_turn_and_by_any_along_a_rail() -> None:
    given = context()
    joints = tuple(replace(joint, type=JointType.PRISMATIC) for joint in given.robot.joints)
    turning, sliding = (
        next(each for each in possible_effects(one) if each.id == "position_dependent_friction" and each.joint == 2)
        for one in (given, replace(given, robot=replace(given.robot, joints=joints)))
    )
    assert not turning.is_free(0)
    assert list(turning.grid[:, 0]) == [1.0, 2.0, 3.0]
    stroke = given.highest[2] - given.lowest[2]
    assert sliding.is_free(0)
    assert sliding.grid[0, 0] * stroke == pytest.approx(1.0)
    assert sliding.grid[-1, 0] * stroke < 6.0 * np.pi


def test_a_clipped_torque_is_short_of_what_lies_beyond_the_level() -> None:
    found = columns("torque_saturation", 2, (5.0,), number=1)[0, 0]
    assert found == pytest.approx(np.where(T > 5.0, 5.0 - T, np.where(T < -5.0, -5.0 - T, 0.0)), abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_a_cable_pulls_back_on_one_side_only(side: int) -> None:
    found = columns("cable_force", 2, (0.1, 1.5), number=0 if side > 0 else 1)[0, 0]
    for q, value in zip(Q[::50], found[::50], strict=True):
        reach = side * (q - 0.1)
        assert value == pytest.approx(side * reach**1.5 if reach > 0 else 0.0)


def test_bristles_follow_dahls_equation() -> None:
    length = 0.02
    deflection = 0.0
    expected = np.empty(len(Q))
    for _ in range(3):  # until a period repeats the one before
        for k in range(len(Q)):
            step = Q[k] - Q[k - 1]  # the motion closes: the last sample comes before the first
            for _ in range(20):
                part = step / 20
                deflection += (part - abs(part) * deflection) / length
            expected[k] = deflection
    found = columns("presliding_hysteresis", 2, (length,))[0, 0] + S
    assert found == pytest.approx(expected, abs=5e-3)
    assert np.abs(found).max() <= 1.0


def test_coupled_friction_acts_on_both_joints_with_the_power_of_the_common_speed() -> None:
    for number, sign in enumerate((1, -1)):
        found = columns("friction_coupling", 2, (K_V,), number=number)
        common = SIGNALS.velocity[2] + sign * SIGNALS.velocity[1]
        effort = 0.7 * found[0] + 0.3 * found[1]
        power = effort[0] * SIGNALS.velocity[1] + effort[1] * SIGNALS.velocity[2]
        friction = 0.7 * 2 / np.pi * np.arctan(K_V * common) + 0.3 * common
        assert power == pytest.approx(friction * common)


def test_drift_goes_on_from_repetition_to_repetition() -> None:
    found = columns("friction_drift", 2, (5.0,))
    time = np.arange(8000).reshape(2, 4000) / RATE
    course = (1.0 - np.exp(-time / 5.0)) / (1.0 - np.exp(-context().durations[0] / 5.0))
    assert found.shape == (2, 1, 2, len(V))
    assert found[1, 0] == pytest.approx(V * course)
    assert found[0, 0] == pytest.approx(S * course)


def test_a_joint_warms_as_fast_as_its_friction_dissipates() -> None:
    """Against the equation of heat, integrated sample by sample; a joint that rests stays cold."""
    by_heat = form("friction_drift", 2, 1)
    (found,) = by_heat.columns(SIGNALS, np.array([[2.0]]))
    power = (2.0 * S + 0.5 * V) * V
    warmth, course = 0.0, []
    for each in np.tile(power, 2):
        warmth = each + (warmth - each) * np.exp(-1.0 / (2.0 * RATE))
        course.append(warmth)
    scale = 1.0 - np.exp(-context().durations[0] / 2.0)
    assert found[1, 0] * scale == pytest.approx(V * np.reshape(course, (2, 4000)), abs=1e-9)
    resting = replace(SIGNALS, velocity=np.zeros_like(SIGNALS.velocity))
    assert not by_heat.columns(resting, np.array([[2.0]])).any()


def test_a_late_torque_is_the_shifted_torque_to_first_order() -> None:
    delay = 4  # samples
    late = np.roll(SIGNALS.torque, delay, axis=1)
    found = columns("time_delay", None)[0] * delay / RATE
    assert found.shape == SIGNALS.torque.shape
    smooth = np.abs(SIGNALS.velocity).min(axis=0) > 0.1  # the friction's steps are no first-order matter
    error = (late - SIGNALS.torque - found)[:, smooth]
    assert np.abs(error).max() < 0.1 * np.abs(found[:, smooth]).max()


@cache
def filtered_torque(constant: float, order: int) -> Array:
    """Torque of every joint behind first-order filters, stepped until it repeats, (n, N)."""
    torque = SIGNALS.torque
    fine = np.linspace(0.0, 1.0, STEPS, endpoint=False) + 0.5 / STEPS
    filtered, states = np.empty_like(torque), [torque[:, 0]] * order
    for _ in range(2):  # the second period begins where the first ended: no constant is a tenth of it
        for k in range(torque.shape[1]):
            for part in fine:
                passed = torque[:, k - 1] + part * (torque[:, k] - torque[:, k - 1])
                for stage, state in enumerate(states):
                    states[stage] = passed + (state - passed) * np.exp(-1.0 / (RATE * STEPS * constant))
                    passed = 0.5 * (state + states[stage])
            filtered[:, k] = states[-1]
    return filtered


@pytest.mark.parametrize("joint", [None, 2])
@pytest.mark.parametrize(
    ("constant", "order"),
    [(0.05, 1), *(pytest.param(*filtered, marks=pytest.mark.slow) for filtered in ((0.004, 1), (0.01, 2)))],
)
def test_a_filtered_torque_follows_the_filter_s_equation(joint: int | None, constant: float, order: int) -> None:
    lags = [each for each in possible_effects(context()) if isinstance(each, Lag) and each.joint == joint]
    lag = next(each for each in lags if each.order == order)
    chosen = slice(None) if joint is None else slice(joint, joint + 1)
    torque, filtered = SIGNALS.torque[chosen], filtered_torque(constant, order)[chosen]
    found = lag.columns(replace(SIGNALS, periodic=True), np.array([[constant]]))[0, 0]
    np.testing.assert_allclose(found, filtered - torque, atol=1e-3 * np.abs(filtered - torque).max())
    slow = np.abs(np.gradient(torque, axis=1)).max() * RATE  # settled at first where it does not repeat
    once = lag.columns(replace(SIGNALS, periodic=False), np.array([[constant]]))[0, 0]
    assert np.abs(once[:, 0]).max() < 1e-12 * np.abs(torque).max()
    assert np.abs(once - found)[:, -1].max() < 1e-6 * slow * constant


@pytest.mark.parametrize("joint", [None, 2])
def test_a_shifted_torque_is_late_by_its_delay(joint: int | None) -> None:
    shift = next(each for each in possible_effects(context()) if type(each) is Shift and each.joint == joint)
    torque = SIGNALS.torque if joint is None else SIGNALS.torque[joint : joint + 1]
    found = shift.columns(replace(SIGNALS, periodic=True), np.array([[0.007], [0.0105]]))[:, 0]
    between = 0.5 * (np.roll(torque, 10, axis=1) + np.roll(torque, 11, axis=1))
    np.testing.assert_allclose(found[0], np.roll(torque, 7, axis=1) - torque, atol=1e-9 * np.abs(torque).max())
    np.testing.assert_allclose(found[1], between - torque, atol=1e-9 * np.abs(torque).max())
    once = shift.columns(replace(SIGNALS, periodic=False), np.array([[0.007]]))[0, 0]
    np.testing.assert_allclose(once[:, 7:], found[0][:, 7:], atol=1e-9 * np.abs(torque).max())


def test_a_tilted_base_is_gravity_in_another_direction() -> None:
    found = columns("base_tilt", None)
    tilt = 1e-4
    for column, axis in zip(found, (0, 1), strict=True):
        gravity = SIGNALS.robot.gravity.copy()
        gravity[axis] += 9.81 * tilt
        tilted = replace(SIGNALS.robot, gravity=gravity)
        picked = slice(None, None, 40)
        state = [each[:, picked] for each in (SIGNALS.position, SIGNALS.velocity, SIGNALS.acceleration)]
        change = torque(tilted, SIGNALS.links, *state) - SIGNALS.load[:, picked]
        assert tilt * column[:, picked] == pytest.approx(change, abs=1e-9)


def test_a_compliant_joint_leaves_the_torque_of_the_link_that_lags() -> None:
    compliance = 1e-5
    lag = compliance * SIGNALS.load[2]
    rate = 2j * np.pi * np.fft.rfftfreq(len(lag), 1 / RATE)
    spectrum = np.fft.rfft(lag)
    state = [SIGNALS.position.copy(), SIGNALS.velocity.copy(), SIGNALS.acceleration.copy()]
    for order, values in enumerate(state):
        values[2] -= np.fft.irfft(rate**order * spectrum, n=len(lag))
    picked = slice(None, None, 40)
    moved = torque(SIGNALS.robot, SIGNALS.links, *(each[:, picked] for each in state))
    found = compliance * columns("joint_elasticity", 2, (400.0, 0.0))[0][:, picked]
    assert found == pytest.approx(moved - SIGNALS.load[:, picked], abs=2e-3 * np.abs(found).max())


def test_an_elastic_joint_swings_on_its_spring() -> None:
    """Far below its resonance the load is passed on as it is, at the resonance it is made larger by 1/(2 ζ)."""
    time = np.arange(4000) / RATE
    inertia = np.full(len(time), 0.3)
    for frequency, resonance, gain in ((0.5, 20.0, 1.0), (2.0, 2.0, 0.5 / DAMPING)):
        compliance = 1.0 / ((2.0 * np.pi * resonance) ** 2 * 0.3)
        found = transmitted(np.sin(2.0 * np.pi * frequency * time), inertia, compliance, RATE)
        assert np.abs(found[-1000:]).max() == pytest.approx(gain, rel=0.02)


def test_a_stated_gear_ratio_leaves_whole_turns_of_the_motor_only() -> None:
    geared = [each for each in possible_effects(context(gear_ratio=20.0)) if each.id == "cogging"]
    assert geared
    for effect in geared:
        assert effect.grid[:, 0] / 20.0 == pytest.approx(np.rint(effect.grid[:, 0] / 20.0))
        assert not effect.is_free(0)
    free = [each for each in possible_effects(context()) if each.id == "cogging"]
    assert all(effect.is_free(0) for effect in free)


def test_bristles_shorter_than_the_encoder_s_noise_are_not_looked_for() -> None:
    given = context()
    noise = 1e-3 * (given.highest - given.lowest)
    (fine,), (coarse,) = (
        [each for each in possible_effects(one) if each.id == "presliding_hysteresis" and each.joint == 2]
        for one in (given, replace(given, position_std=noise))
    )
    assert fine.lower[0] < noise[2]
    assert coarse.lower[0] >= 4.0 * noise[2]
    assert set(coarse.grid[:, 0]) == {length for length in fine.grid[:, 0] if length > 4.0 * noise[2]}


def test_a_swinging_link_tells_its_compliance_twice() -> None:
    elastic, covariance = form("joint_elasticity", 2), np.diag([1e-12, 0.0, 0.0])
    (twice,) = elastic.quantities(context(), np.array([1.6e-4]), np.array([10.0, 1.0e-4]), covariance)
    formula = FIRST_ORDER * 1.6e-4
    assert (twice.name, twice.value) == ("c", pytest.approx(1.3e-4))
    assert twice.std == pytest.approx(np.hypot(0.3e-4, formula), rel=0.01)
    (once,) = elastic.quantities(context(), np.array([1.6e-4]), np.array([10.0, 0.0]), covariance)
    assert (once.value, once.std) == (pytest.approx(1.6e-4), pytest.approx(np.hypot(1e-6, formula)))


def test_a_soft_curve_that_is_only_bent_a_little_may_have_any_share_of_a_higher_level() -> None:
    """tanh(τ/c) ≈ τ/c - (τ/c)³/3: a c and a/c² are one; its level is c/√a."""
    soft = form("torque_saturation", 2)
    lowest = float(soft.lower[0])
    assert soft.is_consistent(np.array([11.7]), np.array([4.0 * lowest]))
    assert not soft.is_consistent(np.array([17.0]), np.array([4.0 * lowest]))
    (level,) = soft.quantities(context(), np.array([11.7]), np.array([33.4]), np.zeros((2, 2)))
    assert level.value == pytest.approx(33.4 / np.sqrt(11.7))


def test_what_gives_way_is_what_the_link_swings_on() -> None:
    """A resonance far from that of the compliance found is some other wave."""
    elastic, swinging = form("joint_elasticity", 2), 1e-4
    assert elastic.is_consistent(np.array([1.5e-4]), np.array([10.0, swinging]))
    assert not elastic.is_consistent(np.array([1e-6]), np.array([10.0, swinging]))
    assert elastic.is_consistent(np.array([1e-6]), np.array([10.0, 0.0])), (
        "where nothing swings there is nothing to compare"
    )


@pytest.mark.parametrize("joint", range(SIGNALS.robot.joint_count))
def test_torque_of_a_small_deflection_is_that_of_the_moved_link(joint: int) -> None:
    """Pinocchio's torque where the link is, less that where its encoder says, of an arm whose links are known."""
    s, reach = SIGNALS, 1e-5
    time = np.arange(s.position.shape[1]) / s.rate_hz
    omega = 2.0 * np.pi * 3.0
    lag, rate, change = (
        reach * omega**order * wave
        for order, wave in enumerate((np.sin(omega * time), np.cos(omega * time), -np.sin(omega * time)))
    )
    moved = [each.copy() for each in (s.position, s.velocity, s.acceleration)]
    for state, part in zip(moved, (lag, rate, change), strict=True):
        state[joint] -= part
    expected = torque(s.robot, s.links, *moved) - torque(s.robot, s.links, s.position, s.velocity, s.acceleration)
    found = torque_of_deflection(s, joint, lag)
    assert np.linalg.norm(found - expected) < 0.01 * np.linalg.norm(expected)


@pytest.mark.parametrize("joint", range(SIGNALS.robot.joint_count))
def test_inertia_that_a_transmission_moves_is_on_the_mass_matrix_diagonal(joint: int) -> None:
    s = SIGNALS
    model = pinocchio_model(s.robot, s.links)
    data = model.createData()
    expected = np.array([pin.crba(model, data, q)[joint, joint] for q in s.position.T])
    np.testing.assert_allclose(inertia_of_link(s, joint), expected, rtol=0.01)


def test_slopes_that_are_kept_serve_other_links() -> None:
    """The same motion under a model with other links: of those that are kept, nothing is left of the first."""
    rng = np.random.default_rng(1)
    other = replace(SIGNALS, bodies=1.5 * SIGNALS.bodies * rng.uniform(0.9, 1.1, len(SIGNALS.bodies)), _memory={})
    fresh = replace(other, of_motion={}, _memory={})
    lag = 1e-3 * np.sin(np.arange(SIGNALS.position.shape[1]) / 100.0)
    torque_of_deflection(SIGNALS, 2, lag)
    np.testing.assert_array_equal(torque_of_deflection(other, 2, lag), torque_of_deflection(fresh, 2, lag))
