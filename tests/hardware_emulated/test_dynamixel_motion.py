"""The Dynamixel driver moves emulated servos in another process: enabling, tracking, current, limits, stopping."""

from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.servo_bench import TORQUE_PER_UNIT, WATCHDOG_S, Bench, bench, drive, limits, setpoint
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_sim.dynamixel_bus import ServoSpecification

pytestmark = pytest.mark.realtime

ONE_COUNT = 2.0 * np.pi / 4096
START = 0.2
FAR_GOALS = {"Goal Position": 3500, "Goal Current": 1193, "Goal Velocity": 200}


def refusal(call, *arguments) -> DriverError:
    with pytest.raises(DriverError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("mode", list(ControlMode))
def test_enabling_never_moves_the_arm_however_stale_its_goals(tmp_path: Path, mode: ControlMode) -> None:
    # Drive Mode 12: torque that a goal switches on, and profiles by time.
    servos = tuple(ServoSpecification(number, registers={**FAR_GOALS, "Drive Mode": 12}) for number in (1, 2, 3))
    with bench(tmp_path, servos, weight=0.0) as one:
        one.enabled_arm(mode, watchdog_s=2.5)
        state = one.let_pass(0.3)
        assert all(state["enabled"])
        assert not state["on_stand"]
        # Where it stands is known to half a count; nothing else moves it.
        places = [[entry["position"] for entry in one.emulator.trace()]]
        assert np.abs(np.array(places) - START).max() < 0.6 * ONE_COUNT


def test_positions_are_tracked(three: Bench) -> None:
    arm = three.enabled_arm()
    states = drive(arm, lambda t: setpoint(START + 0.3 * np.sin(3.0 * t) * np.array([1.0, -1.0, 0.5])), 1.5)
    fresh = np.mean([state.fresh for state in states])
    assert fresh > 0.9
    assert not states[-1].faults
    assert all(state.enabled.all() for state in states)
    # Critically damped loops of 8 Hz lag by 2 ζ/ω = 40 ms at up to 0.9 rad/s, and droop by 0.5 Nm / (J ω²).
    place = START + 0.3 * np.sin(3.0 * 1.5) * np.array([1.0, -1.0, 0.5])
    assert np.abs(states[-1].position - place).max() < 0.9 * 0.04 + 0.01 + 0.9 * 0.03


def test_current_is_what_the_motor_gives(three: Bench) -> None:
    arm = three.enabled_arm()
    states = drive(arm, lambda _: setpoint(np.full(3, 1.0)), 1.0)
    mean = np.nanmean([state.effort for state in states[-50:]], axis=0)
    # Held against gravity: m g l sin q at the place where it hangs.
    expected = 0.5 * np.sin(states[-1].position) / TORQUE_PER_UNIT
    np.testing.assert_allclose(mean, expected, atol=3.0)


def test_targets_are_brought_back_to_the_limits(weightless: Bench) -> None:
    arm = weightless.arm()
    arm.connect()
    arm.enable(ControlMode.POSITION, limits(3, position_high=0.5), StopPolicy.HOLD, WATCHDOG_S)
    drive(arm, lambda _: setpoint(np.full(3, 2.0)), 0.8)
    assert np.all(weightless.position <= 0.5 + ONE_COUNT)
    assert np.all(weightless.position > 0.48)


def test_far_target_is_approached_at_the_speed_limit(weightless: Bench) -> None:
    arm = weightless.arm()
    arm.connect()
    arm.enable(ControlMode.POSITION, limits(3, velocity=0.5), StopPolicy.HOLD, WATCHDOG_S)
    drive(arm, lambda _: setpoint(np.full(3, 1.5)), 0.8)
    speed = np.abs([entry["velocity"] for entry in weightless.emulator.trace()])
    assert speed.max() < 0.55
    assert speed.max() > 0.4


def test_torque_is_commanded_as_current_within_the_cap(weightless: Bench) -> None:
    arm = weightless.arm()
    arm.connect()
    arm.enable(ControlMode.TORQUE, limits(3, torque=0.3), StopPolicy.TORQUE_OFF, WATCHDOG_S)
    arm.exchange(setpoint(np.zeros(3), np.array([0.1, -0.2, 5.0])))
    units = [weightless.emulator.get(servo, "Goal Current") for servo in (1, 2, 3)]
    assert units == [round(0.1 / 0.0269), round(-0.2 / 0.0269), int(0.3 / 0.0269)]


def test_direction_and_reduction_reach_the_joint(tmp_path: Path) -> None:
    servos = (ServoSpecification(1, direction=-1, reduction=2.0, torque_per_milliampere=TORQUE_PER_UNIT),)
    with bench(tmp_path, servos, start=0.4) as one:
        arm = one.arm(direction=-1, reduction=2.0)
        np.testing.assert_allclose(arm.connect().position, 0.4, atol=ONE_COUNT)
        arm.enable(ControlMode.POSITION, limits(1), StopPolicy.HOLD, WATCHDOG_S)
        states = drive(arm, lambda t: setpoint([0.4 + 0.3 * t]), 1.0)
        assert np.nanmean([state.velocity for state in states[-50:]]) == pytest.approx(0.3, abs=0.05)
        # Carrying the weight takes a positive torque at the joint, though the servo turns the other way round.
        assert np.nanmean([state.effort for state in states[-50:]]) > 0.0


def test_stopped_arm_holds_without_cycles(three: Bench) -> None:
    arm = three.enabled_arm()
    drive(arm, lambda t: setpoint(np.full(3, START + 0.5 * t)), 0.6)
    state = arm.stop(StopPolicy.HOLD)
    assert state.enabled.all()
    three.let_pass(0.3)
    place = three.position
    three.let_pass(2.0 * WATCHDOG_S)
    assert np.abs(three.position - place).max() < ONE_COUNT
    assert not any(three.emulator.state["latched"])
    assert not arm.stop(StopPolicy.HOLD).faults


def test_stops_in_a_row_do_not_let_a_loaded_arm_sink(three: Bench) -> None:
    arm = three.enabled_arm()
    drive(arm, lambda _: setpoint(np.full(3, 1.2)), 1.0)
    arm.stop(StopPolicy.HOLD)
    place = three.let_pass(0.3)["position"]
    arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
    arm.stop(StopPolicy.HOLD)
    arm.stop(StopPolicy.HOLD)
    # Taking over gives it a goal where it stands, which it droops from once: 0.5 Nm · sin 1.2 / (0.05 · (16 π)²).
    droop = 0.5 * np.sin(1.2) / (0.05 * (16.0 * np.pi) ** 2)
    assert np.abs(three.let_pass(0.3)["position"] - np.array(place)).max() < 3.0 * droop + ONE_COUNT


def test_torque_off_lets_go_and_another_stop_does_not_take_hold(three: Bench) -> None:
    arm = three.enabled_arm()
    drive(arm, lambda _: setpoint(np.full(3, START)), 0.1)
    assert not arm.stop(StopPolicy.TORQUE_OFF).enabled.any()
    assert not arm.stop(StopPolicy.HOLD).enabled.any()
    three.wait_until(lambda state: np.abs(state["velocity"]).max() > 0.2)


def test_arm_under_torque_control_is_caught_by_a_hold(three: Bench) -> None:
    arm = three.enabled_arm(ControlMode.TORQUE)
    for _ in range(10):
        arm.exchange(setpoint(np.zeros(3), 0.5 * np.sin(START)))
    before = three.position
    assert arm.stop(StopPolicy.HOLD).enabled.all()
    assert [three.emulator.get(servo, "Operating Mode") for servo in (1, 2, 3)] == [5, 5, 5]
    three.let_pass(0.5)
    assert np.abs(three.position - before).max() < 0.05
    assert not any(three.emulator.state["latched"])


def test_torque_control_is_refused_while_the_arm_hangs_on_its_position_loop(three: Bench) -> None:
    arm = three.enabled_arm()
    arm.stop(StopPolicy.HOLD)
    error = refusal(arm.enable, ControlMode.TORQUE, limits(3), StopPolicy.TORQUE_OFF, WATCHDOG_S)
    assert "support the arm" in str(error)
    assert all(three.emulator.state["enabled"])


def test_without_fast_sync_read_each_servo_answers_for_itself(tmp_path: Path) -> None:
    with bench(tmp_path, fast_sync_read=False) as one:
        arm = one.enabled_arm()
        states = drive(arm, lambda _: setpoint(np.full(3, START)), 0.2)
        assert np.mean([state.fresh for state in states]) > 0.9


def test_families_may_be_mixed_on_one_bus(tmp_path: Path) -> None:
    servos = (
        ServoSpecification(1, torque_per_milliampere=TORQUE_PER_UNIT),
        ServoSpecification(2, model_number=2020, torque_per_milliampere=0.001),
        ServoSpecification(3, model_number=4030, torque_per_milliampere=0.001),
    )
    with bench(tmp_path, servos) as one:
        arm = one.arm(torque_constant=0.001)
        np.testing.assert_allclose(arm.connect().position, START, atol=ONE_COUNT)
        arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
        states = drive(arm, lambda t: setpoint(np.full(3, START + 0.3 * t)), 1.0)
        assert not states[-1].faults
        np.testing.assert_allclose(one.position, START + 0.3, atol=0.05)
        arm.stop(StopPolicy.TORQUE_OFF)
