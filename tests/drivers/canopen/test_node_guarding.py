"""Drives without a heartbeat consumer: the host guards them by remote frames, or does not run them."""

from collections.abc import Iterator

import can
import numpy as np
import pytest

from emulated_can_bus import START, EmulatedBus
from tauscope_drivers import ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.doctor import examine
from tauscope_drivers.inspection import Severity
from tauscope_sim.canopen_bus.power_state import PowerState

LIMITS = DriveLimits(*(np.full(3, value) for value in (-3.0, 3.0, 2.0, 20.0)))
WATCHDOG_S = 0.2


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    """Three drives, of which the second watches no heartbeat."""
    with EmulatedBus() as bus:
        hide(bus, 0x1016)
        yield bus


def hide(bus: EmulatedBus, index: int) -> None:
    for place, entry in bus.drives[1].dictionary.entries.items():
        entry.is_visible &= place[0] != index


def enable(bus: EmulatedBus) -> CanopenArm:
    arm = CanopenArm(bus.joints(), patience_s=0.1)
    arm.connect()
    arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, WATCHDOG_S, 0.01)
    return arm


def states(bus: EmulatedBus) -> list[PowerState]:
    return [drive.power.state for drive in bus.drives]


def test_a_guarded_drive_runs_for_longer_than_its_life_time_and_is_let_alone_after_the_stop(bus: EmulatedBus) -> None:
    arm = enable(bus)
    assert any("guards it by remote frames" in remark for remark in arm.capabilities.remarks)
    dictionary = bus.drives[1].dictionary
    assert (dictionary.get(0x100C), dictionary.get(0x100D), dictionary.get(0x1017)) == (20, 10, 0)
    for _ in range(50):
        arm.clock.wait_until_ns(arm.clock.now_ns() + 10_000_000)
        assert not arm.exchange(Setpoint(np.array(START), np.zeros(3))).faults
    assert states(bus) == [PowerState.OPERATION_ENABLED] * 3
    assert not arm.stop(StopPolicy.HOLD).faults
    arm.clock.wait_until_ns(arm.clock.now_ns() + round(2e9 * WATCHDOG_S))
    assert states(bus) == [PowerState.QUICK_STOP_ACTIVE] * 3
    assert (dictionary.get(0x100C), dictionary.get(0x100D)) == (0, 0)
    arm.disconnect()


def test_a_guarded_drive_stops_where_its_host_is_silent(bus: EmulatedBus) -> None:
    arm = enable(bus)
    arm.clock.wait_until_ns(arm.clock.now_ns() + round(2e9 * WATCHDOG_S))
    assert PowerState.OPERATION_ENABLED not in states(bus)
    faults = arm.exchange(Setpoint(np.array(START), np.zeros(3))).faults
    assert [fault.code for fault in faults] == ["watchdog"]
    arm.disconnect()


def test_a_guarded_drive_stops_where_its_bus_is_lost(bus: EmulatedBus) -> None:
    arm = enable(bus)
    bus.swallows = lambda message: message.is_remote_frame
    for _ in range(40):
        arm.clock.wait_until_ns(arm.clock.now_ns() + 10_000_000)
        faults = arm.exchange(Setpoint(np.array(START), np.zeros(3))).faults
        if faults:
            break
    assert [fault.code for fault in faults] == ["watchdog"]
    assert PowerState.OPERATION_ENABLED not in states(bus), "one drive's trouble stops all"
    arm.disconnect()


@pytest.mark.parametrize("is_hidden", [True, False], ids=["no guard time", "an adapter without remote frames"])
def test_doctor_and_run_refuse_what_nothing_would_stop(bus: EmulatedBus, is_hidden: bool) -> None:
    def swallow(message: can.Message) -> bool:
        return message.is_remote_frame

    if is_hidden:
        hide(bus, 0x100C)
    else:
        bus.swallows = swallow
    failures = [finding for finding in examine(bus.joints()) if finding.severity is Severity.FAILURE]
    assert ["not notice that the host is gone" in finding.detail for finding in failures] == [True]
    with pytest.raises(DriverError, match="not notice that the host is gone"):
        enable(bus)
    assert states(bus) == [PowerState.SWITCH_ON_DISABLED] * 3


def test_a_drive_that_guards_already_is_not_asked_by_doctor(bus: EmulatedBus) -> None:
    bus.drives[1].dictionary.put(0x100C, 50)
    bus.drives[1].dictionary.put(0x100D, 2)
    asked: list[int] = []
    bus.swallows = lambda message: message.is_remote_frame and not asked.append(message.arbitration_id)
    assert not [finding for finding in examine(bus.joints()) if finding.severity is Severity.FAILURE]
    assert asked == []
