"""The CANopen driver against emulated drives, frame by frame, in this process."""

from collections.abc import Iterator

import numpy as np
import pytest

from emulated_can_bus import GEAR, RATED_TORQUE_MNM, START, EmulatedBus
from patience import eventually
from tauscope_drivers import ArmState, ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.canopen_bus.drive import AxisMode
from tauscope_sim.canopen_bus.power_state import PowerState

PATIENCE_S = 0.1
"""The drives are a thread of this process: on a busy machine it answers when it gets its turn."""

WATCHDOG_S, LONG_WATCHDOG_S = 0.1, 2.0
COUNT = 2.0 * np.pi / 65536 / GEAR
FREE = np.full(3, np.inf)
LIMITS = DriveLimits(-FREE, FREE, FREE, np.full(3, 20.0))


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    with EmulatedBus() as emulated:
        yield emulated


@pytest.fixture
def arm(bus: EmulatedBus) -> Iterator[CanopenArm]:
    driver = CanopenArm(bus.joints(), patience_s=PATIENCE_S)
    driver.connect()
    yield driver
    driver.disconnect()


def enable_arm(
    arm: CanopenArm, mode: ControlMode = ControlMode.POSITION, watchdog_s: float = LONG_WATCHDOG_S
) -> ArmState:
    return arm.enable(mode, LIMITS, StopPolicy.HOLD, watchdog_s)


def states(bus: EmulatedBus) -> list[PowerState]:
    return [drive.power.state for drive in bus.drives]


def test_connecting_reads_the_arm_and_moves_nothing(bus: EmulatedBus, arm: CanopenArm) -> None:
    arm.disconnect()
    state = arm.connect()
    np.testing.assert_allclose(state.position, START, atol=COUNT)
    # 1.5 Nm are 60 per mille of 0.5 Nm behind the gear of 50
    np.testing.assert_allclose(state.effort, 1.5, atol=0.5 * RATED_TORQUE_MNM / 1e6 * GEAR)
    assert not state.enabled.any()
    assert bus.furthest == [0.0, 0.0, 0.0]


def test_enabling_never_moves_the_arm_whatever_target_is_left_over(bus: EmulatedBus, arm: CanopenArm) -> None:
    assert all(drive.dictionary.get(0x607A) == 0x100000 for drive in bus.drives)
    state = enable_arm(arm)
    assert state.enabled.all()
    assert max(bus.furthest) <= COUNT


def test_targets_are_followed_and_read_at_one_instant(bus: EmulatedBus, arm: CanopenArm) -> None:
    state = enable_arm(arm)
    for step in range(50):
        arm.clock.wait_until_ns(state.time_ns + 5_000_000)
        wanted = np.array(START) + 0.002 * step
        state = arm.exchange(Setpoint(wanted, np.zeros(3)))
        assert state.fresh.all()
    assert np.abs(state.position - wanted).max() <= 0.002 + COUNT


def test_drives_are_told_the_cycle_and_those_that_need_not_know_it_are_left_alone(
    bus: EmulatedBus, arm: CanopenArm
) -> None:
    bus.drives[1].dictionary.put(0x60C2, -4, 2)
    del bus.drives[2].dictionary.entries[0x60C2, 1]
    arm.disconnect()
    arm.connect()
    arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, LONG_WATCHDOG_S, 0.004)
    for drive in bus.drives[:2]:
        assert (drive.dictionary.get(0x60C2, 1), drive.dictionary.get(0x60C2, 2)) == (4, -3)
    assert all(state is PowerState.OPERATION_ENABLED for state in states(bus))


def test_a_cycle_that_a_drive_does_not_take_is_refused_before_it_has_power(bus: EmulatedBus, arm: CanopenArm) -> None:
    with pytest.raises(DriverError, match="choose another rate") as refusal:
        arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, LONG_WATCHDOG_S, 0.5)
    assert refusal.value.kind is DriverErrorKind.REFUSED
    assert all(state is PowerState.SWITCH_ON_DISABLED for state in states(bus))


def test_torque_mode_takes_torque_within_the_cap(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm, ControlMode.TORQUE)
    arm.exchange(Setpoint(np.zeros(3), np.array([5.0, -5.0, 30.0])))
    arm.exchange(Setpoint(np.zeros(3), np.array([5.0, -5.0, 30.0])))
    demands = [drive.demand() for drive in bus.drives]
    assert all(demand.mode is AxisMode.TORQUE for demand in demands)
    np.testing.assert_allclose([demand.torque for demand in demands], [5.0, -5.0, 20.0], atol=0.0126)


def test_a_runaway_that_was_caught_is_not_forgotten_by_reconnecting(bus: EmulatedBus, arm: CanopenArm) -> None:
    narrow = DriveLimits(np.full(3, -1.0), np.full(3, 1.0), FREE, np.full(3, 20.0))
    arm.enable(ControlMode.TORQUE, narrow, StopPolicy.HOLD, LONG_WATCHDOG_S)
    bus.position[1] = 1.2
    found = ("position-limit", 2)
    assert eventually(lambda: found in _faults(arm))
    bus.position[1] = START[1]
    arm.disconnect()
    assert found in [(fault.code, fault.joint) for fault in arm.connect().faults]
    with pytest.raises(DriverError, match="acknowledge it first"):
        enable_arm(arm)
    assert not arm.acknowledge_faults().faults
    assert enable_arm(arm).enabled.all()


def test_a_target_that_is_no_number_is_refused_and_nothing_is_sent(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    seen: list[int] = []
    bus.swallows = lambda message: seen.append(message.arbitration_id) or False
    with pytest.raises(DriverError, match="nothing was sent") as refusal:
        arm.exchange(Setpoint(np.array([0.0, np.nan, 0.0]), np.zeros(3)))
    assert refusal.value.kind is DriverErrorKind.REFUSED
    assert not any(0x200 <= identifier < 0x300 for identifier in seen)


def test_a_silent_host_lets_the_drives_hold_by_themselves(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm, watchdog_s=WATCHDOG_S)
    assert eventually(lambda: all(state is PowerState.QUICK_STOP_ACTIVE for state in states(bus)))
    state = arm.exchange(Setpoint(np.zeros(3), np.zeros(3)))
    np.testing.assert_allclose(state.position, START, atol=COUNT)
    assert [(fault.code, fault.joint) for fault in state.faults] == [("watchdog", None)]
    arm.stop(StopPolicy.HOLD)
    with pytest.raises(DriverError, match="acknowledge it first"):
        enable_arm(arm)
    arm.acknowledge_faults()
    assert all(state is PowerState.QUICK_STOP_ACTIVE for state in states(bus)), "an arm that holds must not be dropped"
    assert enable_arm(arm).enabled.all()


def test_a_fault_is_told_and_reset_only_on_the_operators_word(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    bus.drives[1].fail(0x4310)
    assert eventually(lambda: _faults(arm) == [("over-temperature", 2)])
    arm.stop(StopPolicy.HOLD)
    assert bus.drives[1].power.state is PowerState.FAULT
    with pytest.raises(DriverError, match="drive too hot"):
        enable_arm(arm)
    arm.acknowledge_faults()
    assert enable_arm(arm).enabled.all()


def test_a_drive_that_does_not_answer_leaves_nan_and_nothing_old(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    silent = bus.drives[2].process_data
    silent.synchronise = list
    state = arm.exchange(Setpoint(np.array(START), np.zeros(3)))
    assert state.fresh.tolist() == [True, True, False]
    assert np.isnan(state.effort[2])


def test_a_stop_holds_and_needs_no_cycles_any_more(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm, watchdog_s=WATCHDOG_S)
    arm.stop(StopPolicy.HOLD)
    arm.stop(StopPolicy.HOLD)
    assert all(state is PowerState.QUICK_STOP_ACTIVE for state in states(bus))
    assert not eventually(lambda: any(drive.dictionary.get(0x603F) for drive in bus.drives), within_s=3 * WATCHDOG_S)


def test_letting_go_takes_the_voltage_away(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    arm.stop(StopPolicy.TORQUE_OFF)
    assert all(state is PowerState.SWITCH_ON_DISABLED for state in states(bus))


def test_a_missing_node_is_named(bus: EmulatedBus) -> None:
    bus.swallows = lambda message: message.arbitration_id == 0x602
    with pytest.raises(DriverError, match="node 2: Device type") as refusal:
        CanopenArm(bus.joints()).connect()
    assert refusal.value.kind is DriverErrorKind.CANNOT_CONNECT


def _faults(arm: CanopenArm) -> list[tuple[str, int | None]]:
    state = arm.exchange(Setpoint(np.array(START), np.zeros(3)))
    return [(fault.code, fault.joint) for fault in state.faults]


def test_a_lost_answer_neither_drops_the_arm_nor_is_replaced_by_an_old_one(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    for cycle in range(40):
        bus.deaf = cycle % 3 == 1
        state = arm.exchange(Setpoint(np.array(START), np.zeros(3)))
        assert state.fresh.all() == (not bus.deaf)
        assert all(power is PowerState.OPERATION_ENABLED for power in states(bus))
    bus.deaf = True
    arm.exchange(Setpoint(np.array(START), np.zeros(3)))
    bus.deaf = False
    arm.stop(StopPolicy.HOLD)
    assert all(power is PowerState.QUICK_STOP_ACTIVE for power in states(bus))


def test_a_drive_that_is_gone_does_not_keep_the_others_from_being_stopped(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    node_id = 2
    bus.swallows = lambda message: message.arbitration_id in (0x200 + node_id, 0x600 + node_id)
    state = arm.stop(StopPolicy.HOLD)
    assert ("silent", 2) in [(fault.code, fault.joint) for fault in state.faults]
    assert states(bus)[0] is states(bus)[2] is PowerState.QUICK_STOP_ACTIVE
    assert np.isnan(state.position).tolist() == [False, True, False]
