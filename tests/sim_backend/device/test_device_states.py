"""Activities and their changes, limits and disturbances: the parts of the device that move nothing."""

import itertools

import numpy as np
import pytest

from arm_rigs import START, bench_robot, wide_limits
from tauscope_drivers import ControlMode, DriverError, Setpoint, StopPolicy
from tauscope_sim.device import HOTTEST, Activity, Disturbance, FaultCode, Injection, SimulatedDevice
from tauscope_sim.device.drives import COMMANDED, COMMANDED_BY, POWERED, TRANSITIONS, stopped_by
from tauscope_sim.device.faults import REMEDIES, FaultLatch, device_fault
from tauscope_sim.device.mechanism import resting_posture
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.scenario import Scenario

MS = 1_000_000


@pytest.fixture
def device() -> SimulatedDevice:
    return SimulatedDevice(bench_robot(), Scenario(), start_position=START)


def enable(device: SimulatedDevice, mode: ControlMode = ControlMode.POSITION, watchdog_s: float = 10.0) -> None:
    device.enable(mode, wide_limits(bench_robot()), StopPolicy.HOLD, watchdog_s)


@pytest.mark.parametrize(("activity", "policy"), list(itertools.product(Activity, StopPolicy)))
def test_a_stop_is_legal_everywhere_and_never_adds_power(activity: Activity, policy: StopPolicy) -> None:
    after = stopped_by(activity, policy)
    assert after is activity or after in TRANSITIONS[activity]
    assert after not in COMMANDED
    assert stopped_by(after, policy) is after
    assert after not in POWERED or activity in POWERED


def test_an_arm_is_never_braked_again_by_its_drives() -> None:
    assert set(TRANSITIONS) == set(Activity)
    assert not any(Activity.BRAKED in after for after in TRANSITIONS.values())
    assert {COMMANDED_BY[mode] for mode in ControlMode} == set(COMMANDED)


def test_every_fault_has_a_remedy_in_one_line() -> None:
    assert set(REMEDIES) == set(FaultCode)
    assert all(remedy and "\n" not in remedy for remedy in REMEDIES.values())


def test_the_latch_keeps_the_first_report() -> None:
    latch = FaultLatch()
    latch.latch(device_fault(FaultCode.OVERLOAD, 2, "first"))
    latch.latch(device_fault(FaultCode.OVERLOAD, 2, "second"))
    latch.latch(device_fault(FaultCode.OVERLOAD, 3, "other joint"))
    assert [fault.detail for fault in latch.faults] == ["first", "other joint"]
    latch.clear()
    assert latch.faults == ()


def test_a_braked_arm_stands_still_and_its_physics_waits(device: SimulatedDevice) -> None:
    device.advance_to(3600_000 * MS)
    state = device.read()
    np.testing.assert_array_equal(state.position, START)
    np.testing.assert_array_equal(state.effort, 0.0)
    assert not state.enabled.any()
    assert state.time_ns == 3600_000 * MS


def test_the_watchdog_fires_at_the_tick_after_its_time(device: SimulatedDevice) -> None:
    device.advance_to(100 * MS)
    enable(device, watchdog_s=0.05)
    device.advance_to(150 * MS - 1)
    assert device.activity is Activity.TRACKING
    device.advance_to(150 * MS)
    assert device.activity is Activity.HOLDING
    assert device.fault_codes == ("watchdog",)


def test_time_that_has_passed_changes_nothing(device: SimulatedDevice) -> None:
    enable(device)
    device.advance_to(20 * MS)
    before = device.read()
    device.advance_to(5 * MS)
    after = device.read()
    assert (before.time_ns, before.position.tolist()) == (after.time_ns, after.position.tolist())


@pytest.mark.parametrize("mode", list(ControlMode))
def test_a_lost_host_is_a_watchdog(device: SimulatedDevice, mode: ControlMode) -> None:
    enable(device, mode)
    device.lose_host("the connection ended")
    assert device.activity is Activity.HOLDING
    (fault,) = device.read().faults
    assert (fault.code, fault.detail) == ("watchdog", "the connection ended")


def test_a_lost_host_of_a_stopped_arm_is_no_fault(device: SimulatedDevice) -> None:
    device.lose_host("the connection ended")
    enable(device)
    device.stop(StopPolicy.HOLD)
    device.lose_host("the connection ended")
    assert device.fault_codes == ()


def test_a_slipped_encoder_moves_the_arm_by_as_much(device: SimulatedDevice) -> None:
    enable(device)
    device.advance_to(20 * MS)
    device.inject(Injection(Disturbance.ENCODER_JUMP, joint=2, size=0.05))
    device.advance_to(1000 * MS)
    assert device.read().position[1] == pytest.approx(START[1], abs=2e-3)
    assert device.true_motion[0][1] == pytest.approx(START[1] - 0.05, abs=2e-3)


def test_a_motor_that_is_too_hot_cannot_be_enabled_until_it_has_cooled_down(device: SimulatedDevice) -> None:
    rise = HOTTEST
    device.inject(Injection(Disturbance.OVER_TEMPERATURE, joint=1, start_ns=MS, duration_ns=50 * MS, size=rise))
    device.advance_to(10 * MS)
    assert device.read().temperature[0] > HOTTEST
    with pytest.raises(DriverError, match=r"joint 1: .*\(over-temperature\)"):
        enable(device)
    with pytest.raises(DriverError, match="over-temperature"):
        device.acknowledge_faults()
    device.advance_to(60 * MS)
    device.acknowledge_faults()
    enable(device)


def test_a_joint_that_is_not_there_is_not_disturbed(device: SimulatedDevice) -> None:
    with pytest.raises(DriverError, match="joint 4"):
        device.inject(Injection(Disturbance.OVERLOAD, joint=4))


def test_an_arm_is_carried_back_only_when_it_is_not_enabled(device: SimulatedDevice) -> None:
    enable(device)
    with pytest.raises(DriverError, match="stop it"):
        device.put_back()
    device.stop(StopPolicy.TORQUE_OFF)
    device.advance_to(300 * MS)
    assert np.abs(device.true_motion[0] - START).max() > 0.1
    device.put_back()
    assert device.activity is Activity.BRAKED
    np.testing.assert_array_equal(device.read().position, START)


def test_a_torque_that_no_arm_survives_ends_in_a_fault_and_not_in_a_traceback() -> None:
    robot = bench_robot()
    arm = SimulatedArm(robot, start_position=START)
    arm.connect()
    limits = wide_limits(robot, position_low=-np.inf, position_high=np.inf, velocity=np.inf, torque=np.inf)
    arm.enable(ControlMode.TORQUE, limits, StopPolicy.HOLD, 10.0)
    arm.exchange(Setpoint(START, np.array([0.0, 1e300, 0.0])))
    arm.clock.wait_until_ns(100 * MS)
    state = arm.stop(StopPolicy.HOLD)
    assert np.isfinite(state.position).all()


def test_the_default_place_is_the_resting_posture() -> None:
    position = SimulatedDevice(bench_robot(), Scenario()).read().position
    np.testing.assert_array_equal(position, resting_posture(bench_robot()))
