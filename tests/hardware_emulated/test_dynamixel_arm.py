"""The Dynamixel driver against emulated servos in another process: the order of calls, and what is refused."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hardware_emulated.servo_bench import WATCHDOG_S, Bench, bench, drive, limits, setpoint
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.dynamixel_bus import ServoSpecification

ONE_COUNT = 2.0 * np.pi / 4096
START = 0.2
FAR_GOALS = {"Goal Position": 3500, "Goal Current": 1193, "Goal Velocity": 200}


def refusal(call, *arguments) -> DriverError:
    with pytest.raises(DriverError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return caught.value


def test_connecting_reads_and_gives_no_torque(three: Bench) -> None:
    arm = three.arm()
    state = arm.connect()
    np.testing.assert_allclose(state.position, START, atol=ONE_COUNT)
    assert state.fresh.all()
    assert not state.enabled.any()
    assert not state.faults
    assert state.temperature.tolist() == [30.0] * 3
    assert not any(three.emulator.state["enabled"])
    assert [three.emulator.get(servo, "Return Delay Time") for servo in (1, 2, 3)] == [0, 0, 0]
    assert arm.capabilities.largest_rate_hz > 200.0
    assert arm.capabilities.effort_unit == "mA"


def test_watchdog_is_armed_and_read_back_before_torque(three: Bench) -> None:
    three.enabled_arm(watchdog_s=0.5)
    assert [three.emulator.get(servo, "Bus Watchdog") for servo in (1, 2, 3)] == [25, 25, 25]
    assert [three.emulator.get(servo, "Operating Mode") for servo in (1, 2, 3)] == [5, 5, 5]
    assert [three.emulator.get(servo, "Drive Mode") for servo in (1, 2, 3)] == [0, 0, 0]


def test_limits_reach_the_servos(three: Bench) -> None:
    arm = three.arm()
    arm.connect()
    arm.enable(ControlMode.POSITION, limits(3, velocity=1.0, torque=2.69), StopPolicy.HOLD, WATCHDOG_S)
    assert three.emulator.get(1, "Goal Current") == 100  # 2.69 Nm at 0.01 Nm/mA and 2.69 mA a unit
    assert three.emulator.get(1, "Profile Velocity") == 41  # 41 · 0.02397 rad/s


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_targets_that_are_not_finite_are_refused_and_nothing_is_sent(three: Bench, value: float) -> None:
    arm = three.enabled_arm()
    arm.exchange(setpoint(np.full(3, 0.3)))
    goals = [three.emulator.get(servo, "Goal Position") for servo in (1, 2, 3)]
    for target in (setpoint([0.0, value, 0.0]), setpoint(np.zeros(3), [0.0, 0.0, value]), setpoint(np.zeros(2))):
        assert refusal(arm.exchange, target).kind is DriverErrorKind.REFUSED
    assert [three.emulator.get(servo, "Goal Position") for servo in (1, 2, 3)] == goals


def test_order_of_calls(three: Bench) -> None:
    arm = three.arm()
    hold = (ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
    for call, *arguments in ((arm.enable, *hold), (arm.exchange, setpoint(np.zeros(3))), (arm.acknowledge_faults,)):
        assert refusal(call, *arguments).kind is DriverErrorKind.NOT_CONNECTED
    arm.stop(StopPolicy.HOLD)
    arm.connect()
    assert refusal(arm.connect).kind is DriverErrorKind.CANNOT_CONNECT
    assert refusal(arm.exchange, setpoint(np.zeros(3))).kind is DriverErrorKind.NOT_ENABLED
    arm.enable(*hold)
    assert refusal(arm.enable, *hold).kind is DriverErrorKind.REFUSED
    arm.disconnect()
    arm.disconnect()
    assert arm.connect().enabled.all(), "an enabled arm was left holding"


@pytest.mark.parametrize(
    ("mode", "policy", "possible"),
    [
        (ControlMode.POSITION, StopPolicy.TORQUE_OFF, "hold"),
        (ControlMode.POSITION, StopPolicy.DAMP, "hold"),
        (ControlMode.TORQUE, StopPolicy.HOLD, "torque_off"),
    ],
)
def test_policy_that_the_servos_cannot_carry_out_alone_is_refused(
    three: Bench, mode: ControlMode, policy: StopPolicy, possible: str
) -> None:
    arm = three.arm()
    arm.connect()
    error = refusal(arm.enable, mode, limits(3), policy, WATCHDOG_S)
    assert error.kind is DriverErrorKind.REFUSED
    assert f"ask for {possible}" in str(error)
    assert not any(three.emulator.state["enabled"])


@pytest.mark.parametrize(
    "changes", [{"velocity": 0.0}, {"torque": np.nan}, {"position_low": 1.0, "position_high": 0.0}, {"torque": 1e-6}]
)
def test_senseless_limits_are_refused(three: Bench, changes: dict[str, float]) -> None:
    arm = three.arm()
    arm.connect()
    error = refusal(arm.enable, ControlMode.POSITION, limits(3, **changes), StopPolicy.HOLD, WATCHDOG_S)
    assert error.kind is DriverErrorKind.REFUSED
    assert "joint1" in str(error)
    assert not any(three.emulator.state["enabled"])


def test_joint_outside_its_limits_is_not_enabled(three: Bench) -> None:
    arm = three.arm()
    arm.connect()
    error = refusal(arm.enable, ControlMode.POSITION, limits(3, position_high=0.1), StopPolicy.HOLD, WATCHDOG_S)
    assert "stands at 0.1994, outside its limits -3 to 0.1" in str(error)
    assert "by hand" in str(error)


def test_a_joint_that_a_stop_carried_a_little_too_far_is_enabled_where_it_is(three: Bench) -> None:
    arm = three.arm()
    arm.connect()
    arm.enable(ControlMode.POSITION, limits(3, position_high=START - 0.04), StopPolicy.HOLD, WATCHDOG_S)
    np.testing.assert_allclose(three.position, START, atol=ONE_COUNT)
    drive(arm, lambda _: setpoint(np.full(3, START)), 0.5)
    assert three.position.max() < START - 0.04 + 2.0 * ONE_COUNT, "and it goes back into its range"


def test_a_joint_outside_its_servos_own_position_limits_is_not_enabled(tmp_path: Path) -> None:
    counts = round(0.1 * 1_003_846 / (2.0 * np.pi))
    servo = ServoSpecification(1, 2020, torque_per_milliampere=0.001, registers={"Max Position Limit": counts})
    with bench(tmp_path, (servo,)) as one:
        arm = one.arm(torque_constant=0.001)
        arm.connect()
        error = refusal(arm.enable, ControlMode.POSITION, limits(1), StopPolicy.HOLD, WATCHDOG_S)
        assert "stands at 0.2, its own Position Limits are -3.142 to 0.1" in str(error)
        assert not any(one.emulator.state["enabled"])


def test_torque_needs_a_torque_constant(three: Bench) -> None:
    arm = three.arm(torque_constant=None)
    arm.connect()
    assert arm.capabilities.modes == {ControlMode.POSITION}
    error = refusal(arm.enable, ControlMode.TORQUE, limits(3), StopPolicy.TORQUE_OFF, WATCHDOG_S)
    assert "torque_constant" in str(error)
    arm.enable(ControlMode.POSITION, limits(3, torque=np.inf), StopPolicy.HOLD, WATCHDOG_S)


@pytest.mark.parametrize(
    ("servos", "changes", "message"),
    [
        ((ServoSpecification(1, model_number=1060),), {}, "XL430-W250, which does not measure current"),
        ((ServoSpecification(1),), {"id": 9}, "servo 9 does not answer"),
        ((ServoSpecification(1),), {"model": "XM540-W270"}, "is a XM430-W350, the robot file says XM540-W270"),
        ((ServoSpecification(1),), {"baud": 57_600}, "does not answer on"),
    ],
)
def test_wrong_servos_are_refused(
    tmp_path: Path, servos: tuple[ServoSpecification, ...], changes: dict[str, Any], message: str
) -> None:
    with bench(tmp_path, servos) as one:
        error = refusal(one.arm(**changes).connect)
        assert error.kind is DriverErrorKind.CANNOT_CONNECT
        assert message in str(error)
        assert "joint1" in str(error)


def test_second_host_is_refused_by_the_name_of_the_first(three: Bench) -> None:
    first, second = three.arm(), three.arm()
    first.connect()
    error = refusal(second.connect)
    assert error.kind is DriverErrorKind.CANNOT_CONNECT
    assert f"held by process {os.getpid()}" in str(error)
    first.disconnect()
    second.connect()


def test_missing_port_is_refused(three: Bench) -> None:
    error = refusal(three.arm(port="/dev/ttyUSB_nothing").connect)
    assert error.kind is DriverErrorKind.CANNOT_CONNECT
    assert "is not there" in str(error)


def test_bus_that_goes_away_is_reported_and_everything_stays_legal(tmp_path: Path) -> None:
    with bench(tmp_path) as one:
        arm = one.enabled_arm()
        one.emulator.__exit__(None, None, None)
        error = refusal(drive, arm, lambda _: setpoint(np.full(3, START)), 1.0)
        assert error.kind is DriverErrorKind.LOST
        assert [fault.code for fault in error.faults] == ["lost-bus"]
        state = arm.stop(StopPolicy.HOLD)
        assert [fault.code for fault in state.faults] == ["lost-bus"]
        assert not state.fresh.any()
        assert refusal(arm.connect).kind is DriverErrorKind.CANNOT_CONNECT
        arm.disconnect()


def test_rate_beyond_the_bus_is_refused_with_its_reason(three: Bench) -> None:
    arm = three.arm()
    arm.connect()
    arm.require_rate(200.0)
    error = refusal(arm.require_rate, 2000.0)
    assert error.kind is DriverErrorKind.REFUSED
    assert "latency timer" in str(error) or "the wire" in str(error)


@pytest.mark.slow
def test_the_delay_of_an_adapter_is_learnt_and_no_answer_is_late_for_it(tmp_path: Path) -> None:
    delay_s = 0.006
    with bench(tmp_path, latency_s=delay_s) as one:
        arm = one.arm()
        at_once = arm.capabilities.largest_rate_hz
        arm.connect()
        assert arm.capabilities.largest_rate_hz < min(at_once, 1.0 / (2.0 * delay_s))
        arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
        states = drive(arm, lambda _: setpoint([0.2] * 3), 1.0)
        late = [state.late_ns for state in states if state.fresh.all()]
        assert np.median(late) < 1_000_000, "a constant is no lateness"
        assert len(late) > 0.9 * len(states)
