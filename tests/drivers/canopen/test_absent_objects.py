"""Drives without optional objects or with fixed mappings, and no file that states it: what is done instead."""

from collections.abc import Iterator

import numpy as np
import pytest

from emulated_can_bus import START, EmulatedBus
from tauscope_drivers import ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.session import HostBrake
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.limits import PERSISTENCE
from tauscope_sim.canopen_bus.power_state import PowerState

LIMITS = DriveLimits(np.full(3, -2.0), np.full(3, 2.0), np.full(3, 2.0), np.full(3, 20.0))
STAY = Setpoint(np.array(START), np.zeros(3))
MEASURED_NM = 1.5
"""Torque that the emulated bus lets each drive measure."""


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    with EmulatedBus() as emulated:
        yield emulated


def hide(bus: EmulatedBus, *indices: int, node: int = 2) -> None:
    for (index, _), entry in bus.drives[node - 1].dictionary.entries.items():
        entry.is_visible &= index not in indices


def enable_arm(bus: EmulatedBus, mode: ControlMode = ControlMode.POSITION, limits: DriveLimits = LIMITS) -> CanopenArm:
    arm = CanopenArm(bus.joints(), patience_s=0.1)
    arm.connect()
    try:
        arm.enable(mode, limits, StopPolicy.HOLD, 2.0)
    except DriverError:
        arm.disconnect()
        raise
    return arm


def test_each_absent_object_is_told_once_with_its_joints(bus: EmulatedBus) -> None:
    hide(bus, 0x6072, 0x607D)
    hide(bus, 0x6072, node=3)
    arm = enable_arm(bus)
    assert arm.capabilities.remarks == (
        "joint 2, 3: has no Max torque (0x6072:00): Tauscope stops the arm where the measured torque exceeds the "
        "joint's limit",
        "joint 2: has no Software position limit, lowest (0x607D:01) and Software position limit, highest "
        "(0x607D:02): Tauscope keeps the targets within the joint's range",
    )
    arm.disconnect()


def test_torque_beyond_the_limit_stops_an_arm_whose_drive_has_no_limit(bus: EmulatedBus) -> None:
    low = DriveLimits(LIMITS.position_low, LIMITS.position_high, LIMITS.velocity, np.full(3, 0.5 * MEASURED_NM))
    hide(bus, 0x6072)
    arm = enable_arm(bus, limits=low)
    faults = [fault for _ in range(PERSISTENCE) for fault in arm.exchange(STAY).faults]
    assert {(fault.code, fault.joint) for fault in faults} == {("over-torque", 2)}
    arm.stop(StopPolicy.HOLD)
    assert all(drive.power.state is PowerState.QUICK_STOP_ACTIVE for drive in bus.drives)
    arm.disconnect()


def test_a_drive_that_lets_go_at_a_quick_stop_is_held_by_its_targets(bus: EmulatedBus) -> None:
    hide(bus, 0x605A)
    bus.drives[1].power.quick_stop_stays = False
    arm = enable_arm(bus)
    bus.drives[0].fail(0x4310)
    while not arm.exchange(STAY).faults:
        pass
    far = Setpoint(np.array(START) + 0.5, np.zeros(3))
    arm.exchange(far)
    state = arm.stop(StopPolicy.HOLD)
    assert [fault.joint for fault in state.faults] == [1]
    assert bus.drives[1].power.state is PowerState.OPERATION_ENABLED
    assert bus.drives[2].power.state is PowerState.QUICK_STOP_ACTIVE
    assert bus.furthest[1] < 0.01, "a stop that has begun follows no target"
    arm.disconnect()


def test_such_a_drive_is_refused_in_torque_mode_with_a_stop_that_holds(bus: EmulatedBus) -> None:
    hide(bus, 0x605A)
    bus.drives[1].power.quick_stop_stays = False
    with pytest.raises(DriverError, match=r"joint 2 .* cannot hold in torque mode; run in position mode") as refusal:
        enable_arm(bus, ControlMode.TORQUE)
    assert refusal.value.kind is DriverErrorKind.REFUSED
    assert all(drive.power.state is PowerState.SWITCH_ON_DISABLED for drive in bus.drives)


def test_a_drive_that_would_go_on_without_its_host_is_refused(bus: EmulatedBus) -> None:
    entry = bus.drives[1].dictionary.entries[0x6007, 0]
    entry.value, entry.writable = 0, False
    with pytest.raises(DriverError, match=r"joint 2 .*stays 0: it goes on when the host is gone"):
        enable_arm(bus)
    hide(bus, 0x1016)
    hide(bus, 0x100C)
    with pytest.raises(DriverError, match=r"joint 2 .*it would not notice that the host is gone"):
        enable_arm(bus)


def fix_mapping(bus: EmulatedBus, mapping: int, *entries: int) -> None:
    dictionary = bus.drives[1].dictionary
    for (index, _), entry in dictionary.entries.items():
        if index == mapping:
            entry.writable = False
    for subindex, value in enumerate((len(entries), *entries)):
        dictionary.entries[mapping, subindex].value = value


def test_fixed_mappings_are_found_out_and_used(bus: EmulatedBus) -> None:
    fix_mapping(bus, 0x1600, 0x60400010, 0x60600008)
    fix_mapping(bus, 0x1A00, 0x60410010, 0x60640020)
    arm = enable_arm(bus)
    state = arm.exchange(Setpoint(np.array(START) + 0.001, np.zeros(3)))
    assert state.fresh.all()
    assert np.isfinite(state.effort).all()
    assert bus.drives[1].dictionary.get(0x6060) == 8, "what else a frame holds stays as it is"
    assert all(drive.power.state is PowerState.OPERATION_ENABLED for drive in bus.drives)
    arm.disconnect()


def test_fixed_mappings_without_a_target_are_refused(bus: EmulatedBus) -> None:
    for number in range(4):
        fix_mapping(bus, 0x1600 + number, 0x60400010)
    with pytest.raises(DriverError, match=r"joint 2 .*Target position \(0x607A:00\) is in none of its PDOs"):
        enable_arm(bus)


def test_an_abort_is_told_by_its_meaning(bus: EmulatedBus) -> None:
    bus.drives[1].dictionary.entries[0x6060, 0].writable = False
    with pytest.raises(DriverError) as refusal:
        enable_arm(bus)
    assert "Modes of operation (0x6060:00) = 8 cannot be written: the drive lets it be read only" in str(refusal.value)
    assert "wiring" not in str(refusal.value)


def test_targets_of_a_stop_come_to_rest() -> None:
    brake = HostBrake(np.array([1.0]), np.array([2.0]), 0)
    times = np.arange(0, 200_000_001, 1_000_000)
    way = np.array([brake.targets(int(time))[0] for time in times])
    speed = np.diff(way) / 1e-3
    assert speed[0] == pytest.approx(2.0, rel=0.01)
    assert (np.diff(speed) <= 1e-9).all()
    assert way[-1] == pytest.approx(1.1)
    assert [brake.is_at_rest(int(time)) for time in (99_000_000, 100_000_000)] == [False, True]


def test_a_drive_that_does_not_show_its_mode_is_told(bus: EmulatedBus) -> None:
    bus.drives[1].dictionary.entries[0x6060, 0].hook = None
    bus.drives[1].dictionary.put(0x6061, 1)
    arm = enable_arm(bus)
    assert arm.capabilities.remarks == (
        "joint 2: Modes of operation display (0x6061:00) shows 1, not 8: it may not have changed its mode",
    )
    arm.disconnect()
