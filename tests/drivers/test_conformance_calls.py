"""Every backend: the order of calls, what is refused, and that a refusal sends nothing."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from arm_rigs import RATE_HZ, START, Rig, ask, drive, enable, setpoint, slide, wide_limits
from tauscope_drivers import Backend, ControlMode, DriverError, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.device import Disturbance, Injection


def refusal(call, *arguments) -> DriverError:
    with pytest.raises(DriverError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return caught.value


def enable_arguments(rig: Rig):
    return ControlMode.POSITION, wide_limits(rig.robot), StopPolicy.HOLD, 0.5


def test_nothing_works_before_connecting(rig: Rig) -> None:
    backend = rig.backend
    calls = [
        (backend.enable, *enable_arguments(rig)),
        (backend.exchange, setpoint(START)),
        (backend.acknowledge_faults,),
    ]
    for call, *arguments in calls:
        assert refusal(call, *arguments).kind is DriverErrorKind.NOT_CONNECTED


def test_exchange_needs_an_enabled_arm(rig: Rig) -> None:
    rig.backend.connect()
    assert refusal(rig.backend.exchange, setpoint(START)).kind is DriverErrorKind.NOT_ENABLED
    rig.backend.enable(*enable_arguments(rig))
    rig.backend.exchange(setpoint(START))
    rig.backend.stop(StopPolicy.HOLD)
    assert refusal(rig.backend.exchange, setpoint(START)).kind is DriverErrorKind.NOT_ENABLED


def test_connecting_twice_is_refused_and_reconnecting_is_not(rig: Rig) -> None:
    rig.backend.connect()
    assert refusal(rig.backend.connect).kind is DriverErrorKind.CANNOT_CONNECT
    rig.backend.disconnect()
    rig.backend.disconnect()
    assert not rig.backend.connect().enabled.any()


def test_enabling_twice_is_refused(rig: Rig) -> None:
    enable(rig)
    assert refusal(rig.backend.enable, *enable_arguments(rig)).kind is DriverErrorKind.REFUSED
    assert rig.backend.exchange(setpoint(START)).enabled.all()


@pytest.mark.parametrize("policy", list(StopPolicy))
def test_stop_is_legal_in_every_state_and_idempotent(rig: Rig, policy: StopPolicy) -> None:
    backend = rig.backend
    backend.stop(policy)
    backend.connect()
    assert not backend.stop(policy).enabled.any(), "stopping puts no arm under power"
    np.testing.assert_array_equal(rig.look(), START)
    backend.enable(*enable_arguments(rig))
    first = backend.stop(policy)
    second = backend.stop(policy)
    assert first.enabled.all() == second.enabled.all() == (policy is not StopPolicy.TORQUE_OFF)
    assert not second.faults
    backend.disconnect()
    backend.stop(policy)


def test_a_stop_in_a_fault_keeps_the_fault(rig: Rig) -> None:
    enable(rig, watchdog_s=0.02)
    rig.watch(0.1)
    assert [fault.code for fault in rig.backend.stop(StopPolicy.HOLD).faults] == ["watchdog"]


def test_torque_off_is_not_undone_by_another_stop(rig: Rig) -> None:
    enable(rig)
    rig.backend.stop(StopPolicy.TORQUE_OFF)
    assert not rig.backend.stop(StopPolicy.HOLD).enabled.any()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("field", ["position", "torque"])
def test_a_setpoint_that_is_not_finite_is_refused_and_not_sent(rig: Rig, field: str, value: float) -> None:
    enable(rig, watchdog_s=0.1)
    targets = {"position": START + 1.0, "torque": np.zeros(3)}
    targets[field] = targets[field].copy()
    targets[field][1] = value
    clock = rig.backend.clock
    for _ in range(30):
        assert refusal(rig.backend.exchange, Setpoint(**targets)).kind is DriverErrorKind.REFUSED
        clock.wait_until_ns(clock.now_ns() + 5_000_000)
    # nothing reached the drives: no joint went after its target, and the watchdog starved
    np.testing.assert_allclose(rig.look(), START, atol=1e-3)
    assert [fault.code for fault in rig.backend.exchange(setpoint(START)).faults] == ["watchdog"]


def test_a_setpoint_of_the_wrong_shape_is_refused(rig: Rig) -> None:
    enable(rig)
    assert refusal(rig.backend.exchange, setpoint(np.zeros(2))).kind is DriverErrorKind.REFUSED


@pytest.mark.parametrize(
    "changes",
    [
        {"position_low": 1.0, "position_high": 0.5},
        {"position_low": np.nan},
        {"velocity": 0.0},
        {"torque": -1.0},
        {"torque": np.nan},
        {"position_low": [-2.9, 0.0, -2.9]},
    ],
)
def test_limits_that_make_no_sense_are_refused(rig: Rig, changes: dict[str, Any]) -> None:
    rig.backend.connect()
    limits = wide_limits(rig.robot, **changes)
    error = refusal(rig.backend.enable, ControlMode.POSITION, limits, StopPolicy.HOLD, 0.5)
    assert error.kind is DriverErrorKind.REFUSED
    assert not rig.backend.stop(StopPolicy.HOLD).enabled.any()


def test_capabilities_are_honest(rig: Rig) -> None:
    capabilities = rig.backend.capabilities
    assert capabilities.joint_count == rig.robot.joint_count
    assert capabilities.effort_unit in ("Nm", "mA", "permille")
    shortest, longest = capabilities.watchdog_range_s
    rig.backend.connect()
    for watchdog_s in (0.9 * shortest, 1.1 * longest, 0.0, -1.0, np.nan):
        error = refusal(rig.backend.enable, ControlMode.POSITION, wide_limits(rig.robot), StopPolicy.HOLD, watchdog_s)
        assert error.kind is DriverErrorKind.REFUSED
    for mode in capabilities.modes:
        for policy in capabilities.policies_in(mode):
            for watchdog_s in (shortest, longest):
                # between two of them the arm falls
                limits = wide_limits(rig.robot, position_low=-30.0, position_high=30.0)
                assert rig.backend.enable(mode, limits, policy, watchdog_s).enabled.all()
                rig.backend.stop(StopPolicy.TORQUE_OFF)
                rig.backend.acknowledge_faults()


def test_feed_forward_counts_where_the_backend_says_so(rig: Rig) -> None:
    if not rig.backend.capabilities.takes_feed_forward:
        pytest.skip("the backend takes no feed-forward")
    enable(rig)
    push, rises = np.array([0.0, 1.5, 0.0]), []
    # drives may interpolate over a few cycles: they are short here, for the drives' own loop works against the push; by
    # the machine's clock it may have done so before anybody looks, but not each time
    for _ in range(5 if rig.is_real_time else 1):
        before = drive(rig, lambda _: setpoint(START), 0.05, rate_hz=500.0)[-1].effort
        after = drive(rig, lambda _: setpoint(START, push), 0.02, rate_hz=500.0)
        rises += [rig.torque(state.effort - before)[1] for state in after]
    assert max(rises) > 0.5 * push[1]


def test_the_state_has_the_joints_shape_and_si_units(rig: Rig) -> None:
    state = enable(rig)
    n = rig.robot.joint_count
    for values in (state.position, state.velocity, state.effort, state.temperature):
        assert values.shape == (n,)
        assert values.dtype == np.float64
    assert state.enabled.shape == (n,)
    assert state.enabled.dtype == np.bool_
    assert state.fresh.all()
    if rig.tells_temperature:
        assert np.all((state.temperature > 0.0) & (state.temperature < 100.0))
    else:
        assert np.isnan(state.temperature).all(), "what is not measured is not told"
    np.testing.assert_allclose(state.position, rig.look(), atol=1e-3)
    states = drive(rig, slide(START, 0.4), 0.4)
    time = np.array([state.time_ns for state in states]) * 1e-9
    position = np.array([state.position for state in states])
    velocity = np.array([state.velocity for state in states])
    # over ten cycles each, so that an instant that is known to a fraction of a millisecond does not count
    slope = (position[10:] - position[:-10]) / (time[10:] - time[:-10])[:, None]
    mean = np.array([velocity[k : k + 11].mean(axis=0) for k in range(len(slope))])
    step = rig.position_resolution * RATE_HZ / 10.0
    assert np.all(np.nanmedian(np.abs(slope - mean), axis=0) < max(0.02, step))
    assert np.all(np.nanmax(position, axis=0) - START > 0.05)


def test_time_never_runs_backwards(rig: Rig) -> None:
    enable(rig)
    clock = rig.backend.clock
    before = clock.now_ns()
    for state in drive(rig, slide(START, 0.2), 0.2):
        assert before - 20_000_000_000 < state.time_ns <= clock.now_ns()
    times = [state.time_ns for state in drive(rig, lambda _: setpoint(START), 0.1)]
    assert all(later >= earlier for earlier, later in pairwise(times))
    deadline = clock.now_ns() + 5_000_000
    assert clock.wait_until_ns(deadline) >= deadline
    assert clock.wait_until_ns(deadline - 1_000_000) >= deadline


def test_a_second_host_is_refused_by_the_name_of_the_first(rig: Rig) -> None:
    other: Backend | None = rig.another_host()
    if other is None:
        pytest.skip("the backend is one with its drives")
    rig.backend.connect()
    error = refusal(other.connect)
    assert error.kind is DriverErrorKind.CANNOT_CONNECT
    assert "process" in str(error)
    rig.backend.disconnect()
    other.connect()
    other.disconnect()


def test_a_lost_sample_is_not_a_number_and_concerns_its_joint_alone(rig: Rig) -> None:
    enable(rig)
    rig.inject(Injection(Disturbance.LOST_SAMPLE, joint=2, duration_ns=300_000_000))
    # an answer that all drives share breaks off at the silent one: from the next cycle on each answers for itself
    assert not rig.backend.exchange(setpoint(START)).fresh[1]
    state = ask(rig, setpoint(START), lambda state: bool(state.fresh[[0, 2]].all()))
    assert state.fresh.tolist() == [True, False, True]
    assert np.isnan([state.velocity[1], state.effort[1]]).all()
    drive(rig, lambda _: setpoint(START), 0.6)
    state = ask(rig, setpoint(START))
    assert state.fresh.all()
    assert not state.faults


@pytest.mark.parametrize(
    ("kind", "size", "code"),
    [(Disturbance.OVER_TEMPERATURE, 70.0, "over-temperature"), (Disturbance.OVERLOAD, 0.0, "overload")],
)
def test_a_drives_fault_is_decoded_and_stops_the_arm(rig: Rig, kind: Disturbance, size: float, code: str) -> None:
    enable(rig)
    rig.inject(Injection(kind, joint=3, duration_ns=1_000_000_000, size=size))
    (fault,) = rig.backend.exchange(setpoint(START)).faults
    assert (fault.code, fault.joint) == (code, 3)
    assert fault.detail
    assert fault.remedy
    assert code in str(fault)
    error = refusal(rig.backend.acknowledge_faults)
    assert error.kind is DriverErrorKind.FAULT
    assert [one.code for one in error.faults] == [code], "the cause persists"
    assert not rig.watch(1.1).commanded.any()
    assert not rig.backend.acknowledge_faults().faults
