"""Faults of the kit while the arm moves, as the driver sees them: decoded, with a remedy, never an old value."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hardware_emulated.servo_bench import WATCHDOG_S, Bench, drive, limits, setpoint
from tauscope_drivers import ArmState, ControlMode, DriverError, StopPolicy
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime

START = 0.2

HARDWARE = {FaultKind.OVERLOAD: "overload", FaultKind.OVER_TEMPERATURE: "over-temperature"}

FAULTS = {
    FaultKind.LOSE: InjectedFault(FaultKind.LOSE, 2, count=3),
    FaultKind.CORRUPT: InjectedFault(FaultKind.CORRUPT, 2, count=3),
    FaultKind.LATE: InjectedFault(FaultKind.LATE, 2, count=3, seconds=0.06),
    FaultKind.DUPLICATE: InjectedFault(FaultKind.DUPLICATE, 2, count=5),
    FaultKind.SILENT: InjectedFault(FaultKind.SILENT, 2, seconds=3.0),
    FaultKind.OVER_TEMPERATURE: InjectedFault(FaultKind.OVER_TEMPERATURE, 2),
    FaultKind.OVERLOAD: InjectedFault(FaultKind.OVERLOAD, 2),
    FaultKind.RESET: InjectedFault(FaultKind.RESET, 2, seconds=0.3),
}


def codes(state: ArmState) -> list[tuple[str, int | None]]:
    return [(fault.code, fault.joint) for fault in state.faults]


def still(_: float):
    return setpoint(np.full(3, START))


def running(three: Bench) -> DynamixelArm:
    arm = three.enabled_arm()
    drive(arm, still, 0.1)
    return arm


def states_until(arm: DynamixelArm, wanted: Callable[[ArmState], bool], seconds: float = 5.0) -> list[ArmState]:
    """Cycles until a state is as wanted."""
    states: list[ArmState] = []
    while seconds > 0.0:
        states += drive(arm, still, 0.05)
        if wanted(states[-1]):
            return states
        seconds -= 0.05
    pytest.fail(f"never so; last faults: {states[-1].faults}")


@pytest.mark.parametrize("kind", [FaultKind.LOSE, FaultKind.CORRUPT, FaultKind.LATE])
def test_answer_that_does_not_come_is_not_a_number(three: Bench, kind: FaultKind) -> None:
    arm = running(three)
    three.emulator.inject(FAULTS[kind])
    states = drive(arm, still, 0.4)
    missed = [state for state in states if not state.fresh[1]]
    assert missed, "the missing samples are marked"
    assert all(np.isnan([state.velocity[1], state.effort[1]]).all() for state in missed)
    assert states_until(arm, lambda state: bool(state.fresh.all()))[-1].faults == ()


def test_duplicated_answers_do_no_harm(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(FAULTS[FaultKind.DUPLICATE])
    states = drive(arm, still, 0.3)
    for state in states:
        np.testing.assert_allclose(state.position[state.fresh], START, atol=0.05)


def test_late_answers_are_never_taken_for_new_ones(three: Bench) -> None:
    arm = three.enabled_arm()
    drive(arm, lambda t: setpoint(np.full(3, START)), 0.1)
    three.emulator.inject(*(replace(FAULTS[FaultKind.LATE], at_s=0.05 * k, count=1) for k in range(1, 12)))
    states = drive(arm, lambda t: setpoint(np.full(3, START + 0.8 * t)), 0.8)
    trace = three.emulator.trace()
    truth = np.array([entry["position"] for entry in trace])
    instants = np.array([entry["monotonic_ns"] for entry in trace])
    for state in states:
        near = truth[np.abs(instants - state.time_ns).argmin()]
        # An answer that is 60 ms late is 0.05 rad off; a busy machine takes some milliseconds.
        np.testing.assert_allclose(state.position[state.fresh], near[state.fresh], atol=0.03)


def test_silent_servo_costs_only_its_own_samples(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(FAULTS[FaultKind.SILENT])
    states = drive(arm, still, 0.5)[2:]
    fresh = np.mean([state.fresh for state in states], axis=0)
    assert fresh[1] == 0.0
    assert fresh[0] > 0.5
    assert fresh[2] > 0.5, "servos behind the silent one are still heard"


@pytest.mark.parametrize("kind", list(HARDWARE))
def test_hardware_error_is_decoded_within_a_few_cycles(three: Bench, kind: FaultKind) -> None:
    arm = running(three)
    three.emulator.inject(FAULTS[kind])
    states = states_until(arm, lambda state: bool(state.faults) and state.faults[0].code != "hardware-error")
    assert codes(states[-1]) == [(HARDWARE[kind], 2)]
    fault = states[-1].faults[0]
    assert "Hardware Error Status" in fault.detail
    assert "support the arm" in fault.remedy
    arm.stop(StopPolicy.HOLD)
    with pytest.raises(DriverError, match=HARDWARE[kind]):
        arm.acknowledge_faults()
    assert three.emulator.get(2, "Hardware Error Status") != 0, "nothing was restarted"


def test_servo_that_restarts_is_noticed(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(FAULTS[FaultKind.RESET])
    state = states_until(arm, lambda state: bool(state.faults))[-1]
    assert codes(state) == [("restarted", 2)]
    assert state.enabled.tolist() == [True, False, True]
    arm.stop(StopPolicy.HOLD)
    assert not arm.acknowledge_faults().faults
    arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
    assert states_until(arm, lambda state: bool(state.fresh.all()))[-1].enabled.all()
