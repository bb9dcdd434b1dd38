"""Starting the simulated arm's process, which outlives whoever started it."""

import json
import os
import selectors
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from tauscope.robot import Robot, robot_to_dict
from tauscope_drivers import DriverError
from tauscope_sim.own_process import process_environment

START_TIMEOUT_S = 60.0  # time within which the process has to be ready [s]

_LONGEST_SOCKET_PATH = 107


@dataclass(frozen=True, eq=False)
class DeviceProcess:
    """A running device process."""

    process: "subprocess.Popen[bytes]"
    socket: Path
    trace: Path

    def __enter__(self) -> "DeviceProcess":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    def end(self) -> None:
        """Ask the process to end and wait for it; one that does not is killed."""
        self.process.terminate()
        try:
            self.process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def start_device(
    robot: Robot | Path,
    folder: Path,
    *,
    scenario: Path | None = None,
    start_position: Sequence[float] | None = None,
    linger_s: float = 60.0,
) -> DeviceProcess:
    """Start a simulated arm in real time, in a session of its own: signals to the caller's group do not reach it.

    Raises DriverError ``cannot-connect`` where the process did not start, with its own message.
    `start_position`: where the arm stands; None is `tauscope_sim.device.mechanism.resting_posture` [rad or m];
    `linger_s`: how long the process goes on without a host [s].
    """
    socket, trace, log = folder / "device.sock", folder / "device.csv", folder / "device.log"
    if len(os.fsencode(socket)) > _LONGEST_SOCKET_PATH:
        raise DriverError.no_connection(
            f"{socket}: longer than a socket's path can be; choose a folder with a shorter path"
        )
    command = [sys.executable, "-m", "tauscope_sim.device", "--linger", str(linger_s)]
    command += ["--robot", str(_robot_file(robot, folder)), "--socket", str(socket), "--trace", str(trace)]
    if scenario is not None:
        command += ["--scenario", str(scenario)]
    if start_position is not None:
        command += ["--start-position", json.dumps([float(number) for number in start_position])]
    with log.open("wb") as messages:
        process = subprocess.Popen(  # noqa: S603 (our own module with our own arguments)
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=messages,
            env=process_environment(),
            start_new_session=True,
        )
    device = DeviceProcess(process, socket, trace)
    _await_ready(device, log)
    return device


def _robot_file(robot: Robot | Path, folder: Path) -> Path:
    if isinstance(robot, Path):
        return robot
    file = folder / "device-robot.json"
    file.write_text(json.dumps(robot_to_dict(robot)), encoding="utf-8")
    return file


def _await_ready(device: DeviceProcess, log: Path) -> None:
    word = b""
    if (output := device.process.stdout) is not None:
        with output, selectors.DefaultSelector() as selector:
            selector.register(output, selectors.EVENT_READ)
            word = output.readline() if selector.select(START_TIMEOUT_S) else b""
    if word:
        return
    device.end()
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    reason = lines[-1].removeprefix("error: ") if lines else f"not ready within {START_TIMEOUT_S:.0f} s"
    raise DriverError.no_connection(f"the simulated arm's process did not start: {reason}")
