"""Faults of the kit while an arm of STS3215 servos moves: decoded, never an old value, and no servo is left behind."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.servo_bench import Bench, drive, feetech_bench, limits, setpoint
from prompt_process import prompt_process
from tauscope_drivers import ArmState, ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime

START = 0.2
POSITION_STEP = 2.0 * np.pi / 4096


@pytest.fixture(scope="module")
def servos(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with feetech_bench(tmp_path_factory.mktemp("servos")) as one:
        yield one


@pytest.fixture
def three(servos: Bench) -> Iterator[Bench]:
    with prompt_process():
        yield servos.anew()
        servos.clear()


def still(_: float):
    return setpoint(np.full(3, START))


def running(three: Bench) -> FeetechArm:
    arm = three.enabled_arm()
    drive(arm, still, 0.1)
    return arm


def codes(state: ArmState) -> list[tuple[str, int | None]]:
    return [(fault.code, fault.joint) for fault in state.faults]


def states_until_fault(arm: FeetechArm) -> ArmState:
    for _ in range(100):
        state = drive(arm, still, 0.02)[-1]
        if state.faults:
            return state
    pytest.fail("no fault was reported")


@pytest.mark.parametrize("kind", [FaultKind.LOSE, FaultKind.CORRUPT, FaultKind.LATE])
def test_an_answer_that_does_not_come_is_not_a_number(three: Bench, kind: FaultKind) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(kind, 2, count=3, seconds=0.06))
    states = drive(arm, still, 0.4)
    missed = [state for state in states if not state.fresh[1]]
    assert missed, "the missing samples are marked"
    assert all(np.isnan([state.velocity[1], state.effort[1]]).all() for state in missed)
    later = drive(arm, still, 0.4)
    assert any(state.fresh.all() for state in later[-20:])
    assert later[-1].faults == ()


def test_late_answers_are_never_taken_for_new_ones(three: Bench) -> None:
    arm = running(three)
    late = InjectedFault(FaultKind.LATE, 2, count=1, seconds=0.06)
    three.emulator.inject(*(replace(late, at_s=0.05 * k) for k in range(1, 12)))
    states = drive(arm, lambda t: setpoint(np.full(3, START + 0.8 * t)), 0.8)
    trace = three.emulator.trace()
    truth = np.array([entry["position"] for entry in trace])
    instants = np.array([entry["monotonic_ns"] for entry in trace])
    for state in states:
        near = truth[np.abs(instants - state.time_ns).argmin()]
        # an answer that is 60 ms late is 0.05 rad off; a busy machine takes some milliseconds
        np.testing.assert_allclose(state.position[state.fresh], near[state.fresh], atol=0.03)


def test_a_silent_servo_costs_its_own_samples_and_is_told_to_let_go_at_the_stop(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.SILENT, 2, seconds=0.6))
    states = drive(arm, still, 0.3)[2:]
    fresh = np.mean([state.fresh for state in states], axis=0)
    assert fresh[1] == 0.0
    assert min(fresh[0], fresh[2]) > 0.5
    state = arm.stop(StopPolicy.HOLD)
    assert codes(state)[-1:] == [("silent", None)]
    assert three.emulator.state["enabled"][0]
    assert three.emulator.state["enabled"][2], "the others hold"
    assert not state.enabled[1], "nobody knows that it holds"


def test_a_servo_that_hears_and_does_not_answer_lets_go(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.LOSE, 2, count=500))
    drive(arm, still, 0.1)
    assert codes(arm.stop(StopPolicy.HOLD))[-1:] == [("silent", None)]
    assert three.emulator.state["enabled"] == [True, False, True]


@pytest.mark.parametrize(
    ("kind", "code"), [(FaultKind.OVERLOAD, "overload"), (FaultKind.OVER_TEMPERATURE, "over-temperature")]
)
def test_an_alarm_is_decoded_and_stays_until_its_cause_is_gone(three: Bench, kind: FaultKind, code: str) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(kind, 2))
    state = states_until_fault(arm)
    assert codes(state) == [(code, 2)]
    assert "Status 0x" in state.faults[0].detail
    arm.stop(StopPolicy.HOLD)
    with pytest.raises(DriverError, match=code):
        arm.acknowledge_faults()
    with pytest.raises(DriverError, match=code):
        arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, 0.4)
    three.emulator.put(2, "status", 0)
    assert not arm.acknowledge_faults().faults


def test_a_restart_is_noticed_and_no_goal_switches_torque_on_again(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.RESET, 2, seconds=0.05))
    states = drive(arm, still, 0.5)
    assert codes(states[-1]) == [("restarted", 2)]
    assert three.emulator.get(2, "torque_enable") == 0, "a goal would have switched it on"
    arm.stop(StopPolicy.TORQUE_OFF)
    assert not any(three.emulator.state["enabled"])


def test_a_jump_of_the_encoder_is_what_the_servo_reports(three: Bench) -> None:
    arm = running(three)
    three.emulator.inject(InjectedFault(FaultKind.ENCODER_JUMP, 2, counts=300))
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


def test_no_run_writes_to_eeprom(three: Bench) -> None:
    before = [three.emulator.get(servo, name) for servo in (1, 2, 3) for name in ("return_delay", "mode", "lock")]
    arm = running(three)
    arm.stop(StopPolicy.HOLD)
    arm.stop(StopPolicy.TORQUE_OFF)
    arm.disconnect()
    after = [three.emulator.get(servo, name) for servo in (1, 2, 3) for name in ("return_delay", "mode", "lock")]
    assert after == before


def test_an_echoing_adapter_moves_the_arm_too(tmp_path: Path) -> None:
    with feetech_bench(tmp_path, echoes=True) as one, prompt_process():
        arm = one.enabled_arm()
        states = drive(arm, lambda t: setpoint(np.full(3, START + 0.3 * t)), 0.5)
        assert np.nanmax([state.position for state in states]) > START + 0.1
        assert np.mean([state.fresh.all() for state in states]) > 0.5
