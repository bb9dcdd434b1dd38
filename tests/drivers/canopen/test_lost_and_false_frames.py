"""An arm of emulated drives whose bus loses frames at the worst instants, or tells what cannot be true."""

from collections.abc import Iterator

import can
import numpy as np
import pytest

from emulated_can_bus import START, EmulatedBus
from patience import eventually
from tauscope_drivers import ArmState, ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_sim.canopen_bus.power_state import PowerState

LIMITS = DriveLimits(*(np.full(3, value) for value in (-3.0, 3.0, 2.0, 20.0)))
HERE = Setpoint(np.array(START), np.zeros(3))
SYNC = 0x080
DRIVES = 3
"""Each of them hears every frame."""
QUICK_STOP = 0x02


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    with EmulatedBus() as bus:
        yield bus


@pytest.fixture
def arm(bus: EmulatedBus) -> Iterator[CanopenArm]:
    arm = CanopenArm(bus.joints(), patience_s=0.05)
    yield arm
    arm.disconnect()


def enable_arm(arm: CanopenArm, mode: ControlMode = ControlMode.POSITION, watchdog_s: float = 1.0) -> ArmState:
    arm.connect()
    return arm.enable(mode, LIMITS, StopPolicy.HOLD, watchdog_s, 0.01)


def states(bus: EmulatedBus) -> list[PowerState]:
    return [drive.power.state for drive in bus.drives]


@pytest.mark.parametrize("first", range(3))
def test_an_arm_that_is_enabled_is_seen_whole_though_answers_are_lost(
    bus: EmulatedBus, arm: CanopenArm, first: int
) -> None:
    """Every third SYNC is lost: whichever cycle is the last one, it is so in one of three cases."""
    heard = 0

    def every_third(message: can.Message) -> bool:
        nonlocal heard
        if message.arbitration_id != SYNC:
            return False
        heard += 1
        return (heard - 1) // DRIVES % 3 == first

    bus.swallows = every_third
    assert enable_arm(arm).fresh.all()


def test_a_drive_that_does_not_hear_the_stop_of_another_is_told_again(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm)
    heard = 0

    def first_stop(message: can.Message) -> bool:
        nonlocal heard
        is_stop = message.arbitration_id == 0x203 and message.data[0] == QUICK_STOP
        heard += is_stop
        return is_stop and heard <= DRIVES

    bus.swallows = first_stop
    bus.drives[1].fail(0x4310)
    state = arm.exchange(HERE)
    assert heard > DRIVES, "it was told again"
    assert states(bus) == [PowerState.QUICK_STOP_ACTIVE, PowerState.FAULT, PowerState.QUICK_STOP_ACTIVE]
    assert [(fault.code, fault.joint) for fault in state.faults] == [("over-temperature", 2)]


def test_nobody_waits_for_drives_that_have_stopped_by_themselves(bus: EmulatedBus, arm: CanopenArm) -> None:
    enable_arm(arm, watchdog_s=0.1)
    assert eventually(lambda: states(bus) == [PowerState.QUICK_STOP_ACTIVE] * 3)
    heard = 0

    def count(message: can.Message) -> bool:
        nonlocal heard
        heard += message.arbitration_id == SYNC
        return False

    bus.swallows = count
    state = arm.stop(StopPolicy.HOLD)
    assert [(fault.code, fault.joint) for fault in state.faults] == [("watchdog", None)]
    assert heard == DRIVES, "one cycle: they take no process data any more"


def test_a_position_that_cannot_be_is_missing_once_and_believed_when_it_stays(
    bus: EmulatedBus, arm: CanopenArm
) -> None:
    """In torque mode no joint of this bus goes after its target; 2 rad/s allow 0.06 rad in a cycle of 10 ms."""
    state = enable_arm(arm, ControlMode.TORQUE)

    def next_state() -> ArmState:
        arm.clock.wait_until_ns(state.time_ns + 10_000_000)
        return arm.exchange(HERE)

    state = next_state()
    bus.position[1] = START[1] + 1.0
    state = next_state()
    assert state.fresh.tolist() == [True, False, True]
    assert np.isnan(state.effort[1]), "of the same frame"
    bus.position[1] = START[1]
    state = next_state()
    np.testing.assert_allclose(state.position, START, atol=1e-5)
    bus.position[1] = START[1] + 1.0
    assert not next_state().fresh[1]
    assert next_state().position[1] == pytest.approx(START[1] + 1.0, abs=1e-5)
