"""The device process: it outlives its host, stops the arm when the host is killed or frozen, and proves it."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from arm_rigs import AT_REST, START, bench_robot, wide_limits
from device_trace import DeviceTrace, read_trace
from shared_data import REPOSITORY
from tauscope.errors import RecordingError
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.device import Activity
from tauscope_sim.driver import DeviceProcess, RemoteSimulatedArm, start_device

PATIENCE_S = 30.0
WATCHDOG_S = 0.3
GLANCE_S = 0.02

HOST = """
import sys
from pathlib import Path
import numpy as np
sys.path[:0] = [{tests!r}]
from arm_rigs import START, bench_robot, slide, wide_limits
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_sim.driver import RemoteSimulatedArm
arm = RemoteSimulatedArm(Path({socket!r}), 3, reply_timeout_s=5.0)
arm.connect()
arm.enable(ControlMode.POSITION, wide_limits(bench_robot()), StopPolicy.HOLD, {watchdog})
begin = arm.clock.now_ns()
command = slide(START, 0.2)
cycle, moving = 0, False
while True:
    cycle += 1
    arm.clock.wait_until_ns(begin + cycle * 4_000_000)
    state = arm.exchange(command((arm.clock.now_ns() - begin) * 1e-9))
    if not moving and state.velocity.min() > 0.15:
        moving = True
        print("moving", flush=True)
"""


def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for something that the device does by itself."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.002)


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DeviceProcess]:
    folder = tmp_path_factory.mktemp("device")
    with start_device(bench_robot(), folder, start_position=START.tolist(), linger_s=60.0) as process:
        yield process


@pytest.fixture
def device(process: DeviceProcess) -> DeviceProcess:
    """The device with its arm carried back and its faults gone."""
    arm = RemoteSimulatedArm(process.socket, 3)
    arm.connect()
    arm.stop(StopPolicy.HOLD)
    arm.put_back()
    arm.disconnect()
    return process


@pytest.fixture
def host(device: DeviceProcess) -> Iterator["subprocess.Popen[str]"]:
    """A host process that has the arm in motion."""
    script = HOST.format(tests=str(REPOSITORY / "tests"), socket=str(device.socket), watchdog=WATCHDOG_S)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "moving\n"
        yield process
        process.kill()


def rest_after(device: DeviceProcess, instant_ns: int) -> DeviceTrace:
    """The trace once the arm has been at rest for a while."""
    until(
        lambda: read_trace(device.trace).time_ns[-1] > instant_ns + int((WATCHDOG_S + 0.5) * 1e9),
        "the device's trace does not go on",
    )
    return read_trace(device.trace)


def assert_stopped_in_time(trace: DeviceTrace, instant_ns: int) -> None:
    since = (trace.time_ns - instant_ns) * 1e-9
    assert np.abs(trace.velocity[(since > -0.2) & (since < 0.0)]).max() > 0.1, "the arm was moving"
    stopped = (since >= 0.0) & [activity is Activity.HOLDING for activity in trace.activity]
    assert since[stopped][0] <= 1.1 * WATCHDOG_S + GLANCE_S
    assert trace.faults[-1] == ("watchdog",)
    assert np.abs(trace.velocity[-1]).max() < AT_REST
    # the target runs on for a few cycles without setpoints, then a hold takes 0.1 s
    assert np.abs(trace.position[-1] - trace.position[since < 0.0][-1]).max() < 0.2 * 0.3


@pytest.mark.parametrize("kind", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.slow)])
def test_the_arm_stops_when_its_host_is_killed_or_frozen(
    device: DeviceProcess, host: "subprocess.Popen[str]", kind: signal.Signals
) -> None:
    struck_ns = time.monotonic_ns()
    host.send_signal(kind)
    trace = rest_after(device, struck_ns)
    assert_stopped_in_time(trace, struck_ns)
    assert device.process.poll() is None, "the device lives on"
    if kind is signal.SIGKILL:
        arm = RemoteSimulatedArm(device.socket, 3)
        state = arm.connect()
        assert [fault.code for fault in state.faults] == ["watchdog"]
        with pytest.raises(DriverError) as caught:
            arm.enable(ControlMode.POSITION, wide_limits(bench_robot()), StopPolicy.HOLD, 0.5)
        assert caught.value.kind is DriverErrorKind.FAULT
        arm.acknowledge_faults()
        arm.disconnect()
    else:
        with pytest.raises(DriverError, match=f"held by process {host.pid}"):
            RemoteSimulatedArm(device.socket, 3).connect()


def test_broken_frames_end_the_connection_and_stop_the_arm(device: DeviceProcess) -> None:
    arm = RemoteSimulatedArm(device.socket, 3, reply_timeout_s=5.0)
    arm.connect()
    arm.enable(ControlMode.POSITION, wide_limits(bench_robot()), StopPolicy.HOLD, 5.0)
    connection = arm._socket
    assert connection is not None
    connection.sendall(b"\xff" * 64)
    with pytest.raises(DriverError) as caught:
        arm.status()
    assert caught.value.kind is DriverErrorKind.LOST
    until(lambda: read_trace(device.trace).faults[-1] == ("watchdog",), "the arm was not stopped")
    assert arm.connect().faults[0].detail.startswith("the host's connection broke")
    arm.disconnect()


def test_a_request_that_makes_no_sense_is_refused_and_the_connection_lives(device: DeviceProcess) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as raw:
        raw.settimeout(PATIENCE_S)
        raw.connect(str(device.socket))
        for request in (b"\x02\0\0\0\x01\0\0\0\x02\0\0\0{}", b"\x40\0\0\0\x02\0\0\0\0\0\0\0"):
            raw.sendall(request)
            reply = raw.recv(4096)
            assert reply[0] == 66
            assert b"does not understand" in reply
    arm = RemoteSimulatedArm(device.socket, 2)
    with pytest.raises(DriverError, match="3 joints"):
        arm.connect()


def test_interrupting_the_terminal_does_not_reach_it(device: DeviceProcess) -> None:
    assert os.getsid(device.process.pid) != os.getsid(0)
    device.process.send_signal(signal.SIGINT)
    arm = RemoteSimulatedArm(device.socket, 3)
    arm.connect()
    arm.disconnect()


def test_it_ends_when_it_is_asked_to(tmp_path: Path) -> None:
    with start_device(bench_robot(), tmp_path) as device:
        arm = RemoteSimulatedArm(device.socket, 3)
        arm.connect()
        assert arm.status()["activity"] == "braked"
        arm.disconnect()
        device.process.terminate()
        assert device.process.wait(PATIENCE_S) == 0
        assert not device.socket.exists()
        with pytest.raises(DriverError) as caught:
            arm.connect()
        assert caught.value.kind is DriverErrorKind.CANNOT_CONNECT


def test_it_ends_by_itself_when_it_has_been_alone_for_long_enough(tmp_path: Path) -> None:
    with start_device(bench_robot(), tmp_path, linger_s=0.3) as device:
        assert device.process.wait(PATIENCE_S) == 0
    assert read_trace(device.trace).activity[-1] is Activity.BRAKED


def test_a_device_that_cannot_start_says_why(tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("effects: [{effect: no_such_effect}]\n")
    with pytest.raises(DriverError, match="no_such_effect") as caught:
        start_device(bench_robot(), tmp_path, scenario=scenario)
    assert caught.value.kind is DriverErrorKind.CANNOT_CONNECT
    assert "\n" not in str(caught.value)


def test_a_trace_is_read_up_to_its_last_whole_line(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_text("time_ns,activity,faults,q1,qd1\n5,tracking,,0.5,0.1\n9,holding,watchdog+overload,0.6,0.0\n12,hol")
    trace = read_trace(path)
    assert trace.time_ns.tolist() == [5, 9]
    assert trace.activity == (Activity.TRACKING, Activity.HOLDING)
    assert trace.faults == ((), ("watchdog", "overload"))
    assert trace.position.tolist() == [[0.5], [0.6]]
    path.write_text("t,q1\n")
    with pytest.raises(RecordingError, match="not a trace"):
        read_trace(path)
