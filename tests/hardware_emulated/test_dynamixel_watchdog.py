"""The servos' own watchdog: it stops the arm when the host falls silent or dies, latches, and is cleared with care."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.servo_bench import WATCHDOG_S, Bench, drive, limits, setpoint
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.errors import DriverErrorKind

pytestmark = pytest.mark.realtime

START = 0.2
ONE_COUNT = 2.0 * np.pi / 4096
HOLD = (ControlMode.POSITION, limits(3), StopPolicy.HOLD, WATCHDOG_S)


def codes(faults) -> set[str]:
    return {fault.code for fault in faults}


def refusal(call, *arguments) -> DriverError:
    with pytest.raises(DriverError) as caught:
        call(*arguments)
    return caught.value


def silent(three: Bench, arm: DynamixelArm) -> None:
    """Until every servo has stopped."""
    three.wait_until(lambda state: all(state["latched"]))


def test_silence_stops_the_arm_in_its_time(three: Bench) -> None:
    arm = three.enabled_arm(watchdog_s=0.2)
    drive(arm, lambda t: setpoint(np.full(3, START + 0.5 * t)), 0.3)
    begin = three.emulator.state["time"]
    silent(three, arm)
    assert max(three.emulator.state["latched_at"]) - begin <= 0.2 * 1.1
    three.let_pass(0.3)
    assert np.abs(three.emulator.state["velocity"]).max() < 1e-3
    assert all(three.emulator.state["enabled"]), "it holds"


def test_latched_watchdog_is_reported_at_once_and_until_it_is_acknowledged(three: Bench) -> None:
    arm = three.enabled_arm(watchdog_s=0.2)
    drive(arm, lambda _: setpoint(np.full(3, START)), 0.1)
    silent(three, arm)
    state = arm.exchange(setpoint(np.full(3, 1.0)))
    assert codes(state.faults) == {"watchdog"}
    assert [fault.joint for fault in state.faults] == [None]
    assert codes(arm.stop(StopPolicy.HOLD).faults) == {"watchdog"}
    error = refusal(arm.enable, *HOLD)
    assert error.kind is DriverErrorKind.FAULT
    assert codes(error.faults) == {"watchdog"}
    assert not arm.acknowledge_faults().faults
    assert not arm.enable(*HOLD).faults


def test_fault_survives_the_host(three: Bench) -> None:
    first = three.enabled_arm(watchdog_s=0.2)
    drive(first, lambda _: setpoint(np.full(3, START)), 0.1)
    silent(three, first)
    first.disconnect()
    second = three.arm()
    state = second.connect()
    assert codes(state.faults) == {"watchdog"}
    assert state.enabled.all()
    assert refusal(second.enable, *HOLD).kind is DriverErrorKind.FAULT
    assert all(three.emulator.state["latched"]), "nothing was cleared without being asked"


def test_acknowledging_moves_nothing(three: Bench) -> None:
    arm = three.enabled_arm(watchdog_s=0.2)
    drive(arm, lambda t: setpoint(np.full(3, START + 0.6 * t)), 0.5)
    silent(three, arm)
    place = np.array(three.let_pass(0.3)["position"])
    begin = three.emulator.state["time"]
    arm.acknowledge_faults()
    three.let_pass(0.2)
    seen = [entry["position"] for entry in three.emulator.trace() if entry["time"] > begin]
    # A new goal where it stands, from which it droops once more under its load, at most m g l / (J ω²).
    assert np.abs(np.array(seen) - place).max() < 0.5 / (0.05 * (16.0 * np.pi) ** 2) + ONE_COUNT


def test_servo_far_from_its_old_goal_is_not_let_go_after_it(three: Bench) -> None:
    arm = three.enabled_arm(watchdog_s=0.2)
    drive(arm, lambda _: setpoint(np.full(3, START)), 0.1)
    silent(three, arm)
    three.emulator.put(2, "Goal Position", 3500)
    arm.stop(StopPolicy.HOLD)
    error = refusal(arm.acknowledge_faults)
    assert error.kind is DriverErrorKind.FAULT
    assert "joint2" in str(error)
    assert "support the arm" in str(error)
    assert three.emulator.state["latched"][1]
    arm.stop(StopPolicy.TORQUE_OFF)
    assert all(three.emulator.state["latched"]), "letting go is no acknowledgement"
    assert not arm.acknowledge_faults().faults


def test_silence_under_torque_control_ends_in_no_torque(three: Bench) -> None:
    arm = three.enabled_arm(ControlMode.TORQUE, watchdog_s=0.2)
    arm.exchange(setpoint(np.zeros(3), np.full(3, 0.3)))
    silent(three, arm)
    assert three.emulator.state["torque"] == [0.0] * 3
    state = arm.exchange(setpoint(np.zeros(3), np.full(3, 0.3)))
    assert codes(state.faults) == {"watchdog"}
    assert not state.enabled.any()
    assert three.emulator.state["torque"] == [0.0] * 3
    assert not arm.acknowledge_faults().faults
    # The old current of 0.3 Nm came back for nobody.
    assert three.emulator.state["torque"] == [0.0] * 3


@pytest.mark.parametrize("watchdog_s", [0.01, 2.6, 0.0, -1.0, np.nan])
def test_impossible_time_is_refused(three: Bench, watchdog_s: float) -> None:
    arm = three.arm()
    arm.connect()
    error = refusal(arm.enable, ControlMode.POSITION, limits(3), StopPolicy.HOLD, watchdog_s)
    assert error.kind is DriverErrorKind.REFUSED
    assert not any(three.emulator.state["enabled"])


CLIENT = """
import sys
import numpy as np
sys.path[:0] = [{tests!r}]
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.drive_block import DriveJoint
from hardware_emulated.servo_bench import drive, limits, setpoint
joints = [DriveJoint(f"joint{{n}}", {{"id": n, "port": {port!r}}}, torque_per_unit=0.01) for n in (1, 2, 3)]
arm = DynamixelArm(joints, slack_s=0.03)
arm.connect()
arm.enable(ControlMode.POSITION, limits(3), StopPolicy.HOLD, {watchdog!r})
print("moving", flush=True)
drive(arm, lambda t: setpoint(0.2 + 0.4 * np.sin(4.0 * t) * np.ones(3)), 60.0)
"""


def moving_client(one: Bench) -> subprocess.Popen[bytes]:
    """A host in a process of its own, once its arm moves."""
    tests = Path(__file__).parents[1]
    script = CLIENT.format(tests=str(tests), port=one.emulator.order.port, watchdog=WATCHDOG_S)
    client = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
    assert client.stdout is not None
    assert client.stdout.readline() == b"moving\n"
    return client


def hit(one: Bench, how: signal.Signals, after_s: float) -> None:
    """Kill or freeze a host in the middle of motion: the device stops by itself, and the next host has to be told."""
    client = moving_client(one)
    try:
        one.let_pass(after_s)
        os.kill(client.pid, how)
        begin = one.emulator.state["time"]
        one.wait_until(lambda state: all(state["latched"]))
        place = np.array(one.let_pass(0.3)["position"])
        assert max(one.emulator.state["latched_at"]) - begin <= 1.1 * WATCHDOG_S
        state = one.let_pass(0.2)
        assert np.abs(state["velocity"]).max() < 5e-3
        assert np.abs(np.array(state["position"]) - place).max() < ONE_COUNT
        assert all(state["enabled"]), "no drop"
    finally:
        client.kill()
        client.wait()
        assert client.stdout is not None
        client.stdout.close()
    arm = one.arm()
    assert codes(arm.connect().faults) == {"watchdog"}
    assert refusal(arm.enable, *HOLD).kind is DriverErrorKind.FAULT
    assert not arm.acknowledge_faults().faults
    arm.enable(*HOLD)
    drive(arm, lambda _: setpoint(np.full(3, START)), 0.1)
    arm.stop(StopPolicy.HOLD)
    arm.disconnect()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_dead_or_frozen_host(three: Bench, how: signal.Signals) -> None:
    hit(three, how, 0.3)


@pytest.mark.proof
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_dead_or_frozen_host_at_random_instants(three: Bench, how: signal.Signals) -> None:
    instants = random.Random(4)
    for _ in range(10):
        hit(three, how, instants.uniform(0.0, 0.8))
