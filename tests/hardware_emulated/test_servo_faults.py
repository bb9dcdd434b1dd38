"""Faults of the kit while servos move, as the drivers see them: decoded, with a remedy, never an old value."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hardware_emulated.servo_bench import WATCHDOG_S, Bench, bench, drive, feetech_bench, limits, setpoint
from prompt_process import prompt_process
from tauscope_drivers import ArmState, Backend, ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime

START = 0.2
POSITION_STEP = 2.0 * np.pi / 4096
HARDWARE = {FaultKind.OVERLOAD: "overload", FaultKind.OVER_TEMPERATURE: "over-temperature"}
LATE = InjectedFault(FaultKind.LATE, 2, count=3, seconds=0.06)


@pytest.fixture(scope="module", params=[bench, feetech_bench], ids=["dynamixel", "feetech"])
def benches(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with request.param(tmp_path_factory.mktemp("servos")) as one:
        yield one


@pytest.fixture
def three(benches: Bench) -> Iterator[Bench]:
    """Servos of either maker."""
    with prompt_process():
        yield benches.anew()
        benches.clear()


@pytest.fixture(scope="module")
def feetech(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with feetech_bench(tmp_path_factory.mktemp("feetech")) as one:
        yield one


@pytest.fixture
def sts(feetech: Bench) -> Iterator[Bench]:
    """Servos that have no watchdog."""
    with prompt_process():
        yield feetech.anew()
        feetech.clear()


def codes(state: ArmState) -> list[tuple[str, int | None]]:
    return [(fault.code, fault.joint) for fault in state.faults]


def still(_: float):
    return setpoint(np.full(3, START))


def running(one: Bench) -> Any:
    arm = one.enabled_arm()
    drive(arm, still, 0.1)
    return arm


def states_until(arm: Backend, wanted: Callable[[ArmState], bool], seconds: float = 5.0) -> list[ArmState]:
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
    three.emulator.inject(replace(LATE, kind=kind))
    states = drive(arm, still, 0.4)
    missed = [state for state in states if not state.fresh[1]]
    assert missed, "the missing samples are marked"
    assert all(np.isnan([state.velocity[1], state.effort[1]]).all() for state in missed)
    assert states_until(arm, lambda state: bool(state.fresh.all()))[-1].faults == ()


def test_duplicated_answers_do_no_harm(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.DUPLICATE, 2, count=5))
    for state in drive(arm, still, 0.3):
        np.testing.assert_allclose(state.position[state.fresh], START, atol=0.05)


def test_late_answers_are_never_taken_for_new_ones(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(*(replace(LATE, at_s=0.05 * k, count=1) for k in range(1, 12)))
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
    three.emulator.inject(InjectedFault(FaultKind.SILENT, 2, seconds=3.0))
    states = drive(arm, still, 0.5)[2:]
    fresh = np.mean([state.fresh for state in states], axis=0)
    assert fresh[1] == 0.0
    assert min(fresh[0], fresh[2]) > 0.5, "servos behind the silent one are still heard"


@pytest.mark.parametrize("kind", list(HARDWARE))
def test_hardware_error_is_decoded_and_stays_until_its_cause_is_gone(three: Bench, kind: FaultKind) -> None:
    arm, is_sts = running(three), three.make_arm is FeetechArm
    register = "status" if is_sts else "Hardware Error Status"
    three.emulator.inject(InjectedFault(kind, 2))
    states = states_until(arm, lambda state: bool(state.faults) and state.faults[0].code != "hardware-error")
    assert codes(states[-1]) == [(HARDWARE[kind], 2)]
    fault = states[-1].faults[0]
    assert ("Status 0x" if is_sts else "Hardware Error Status") in fault.detail
    assert is_sts or "support the arm" in fault.remedy
    arm.stop(StopPolicy.HOLD)
    with pytest.raises(DriverError, match=HARDWARE[kind]):
        arm.acknowledge_faults()
    with pytest.raises(DriverError, match=HARDWARE[kind]):
        arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
    assert three.emulator.get(2, register) != 0, "nothing was restarted"
    three.emulator.put(2, register, 0)
    assert not arm.acknowledge_faults().faults


def test_servo_that_restarts_is_noticed_and_enabled_again(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.RESET, 2, seconds=0.3))
    state = states_until(arm, lambda state: bool(state.faults))[-1]
    assert codes(state) == [("restarted", 2)]
    assert state.enabled.tolist() == [True, False, True]
    arm.stop(StopPolicy.HOLD)
    assert not arm.acknowledge_faults().faults
    arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)
    assert states_until(arm, lambda state: bool(state.fresh.all()))[-1].enabled.all()


def test_a_silent_servo_is_told_to_let_go_at_the_stop(sts: Bench) -> None:
    arm = running(sts)
    sts.emulator.inject(InjectedFault(FaultKind.SILENT, 2, seconds=0.6))
    drive(arm, still, 0.3)
    state = arm.stop(StopPolicy.HOLD)
    assert codes(state)[-1:] == [("silent", None)]
    assert sts.emulator.state["enabled"][0]
    assert sts.emulator.state["enabled"][2], "the others hold"
    assert not state.enabled[1], "nobody knows that it holds"


def test_a_servo_that_hears_and_does_not_answer_lets_go(sts: Bench) -> None:
    arm = running(sts)
    sts.emulator.inject(InjectedFault(FaultKind.LOSE, 2, count=500))
    drive(arm, still, 0.1)
    assert codes(arm.stop(StopPolicy.HOLD))[-1:] == [("silent", None)]
    assert sts.emulator.state["enabled"] == [True, False, True]


def test_no_goal_switches_the_torque_of_a_restarted_servo_on_again(sts: Bench) -> None:
    arm = running(sts)
    sts.emulator.inject(InjectedFault(FaultKind.RESET, 2, seconds=0.05))
    states = drive(arm, still, 0.5)
    assert codes(states[-1]) == [("restarted", 2)]
    assert sts.emulator.get(2, "torque_enable") == 0, "a goal would have switched it on"
    arm.stop(StopPolicy.TORQUE_OFF)
    assert not any(sts.emulator.state["enabled"])


def test_a_jump_of_the_encoder_is_what_the_servo_reports(sts: Bench) -> None:
    arm = running(sts)
    sts.emulator.inject(InjectedFault(FaultKind.ENCODER_JUMP, 2, counts=300))
    state = arm.exchange(still(0.0))
    assert abs(state.position[1] - START) > 100 * POSITION_STEP


def test_a_lost_bus_is_said_and_the_servos_hold(tmp_path: Path) -> None:
    with feetech_bench(tmp_path) as one:
        arm = one.enabled_arm()
        drive(arm, still, 0.05)
        one.emulator.__exit__(None, None, None)
        with pytest.raises(DriverError) as caught:
            drive(arm, still, 0.5)
        assert caught.value.kind is DriverErrorKind.LOST
        assert codes(arm.stop(StopPolicy.HOLD)) == [("lost-bus", None)]


def test_no_run_writes_to_eeprom(sts: Bench) -> None:
    def settings() -> list[int]:
        return [sts.emulator.get(servo, name) for servo in (1, 2, 3) for name in ("return_delay", "mode", "lock")]

    before = settings()
    arm = running(sts)
    arm.stop(StopPolicy.HOLD)
    arm.stop(StopPolicy.TORQUE_OFF)
    arm.disconnect()
    assert settings() == before


def test_an_echoing_adapter_moves_the_arm_too(tmp_path: Path) -> None:
    with feetech_bench(tmp_path, echoes=True) as one, prompt_process():
        arm = one.enabled_arm()
        states = drive(arm, lambda t: setpoint(np.full(3, START + 0.3 * t)), 0.5)
        assert np.nanmax([state.position for state in states]) > START + 0.1
        assert np.mean([state.fresh.all() for state in states]) > 0.5
