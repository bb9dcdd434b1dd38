"""``python -m tauscope_sim.device``: the simulated arm as a process of its own, in real time, behind a Unix socket."""

import argparse
import contextlib
import json
import os
import signal
import socket
import sys
import time
from pathlib import Path

from tauscope.errors import RobotFileError, TauscopeError
from tauscope.robot import Robot, read_robot, robot_from_dict
from tauscope_sim.device.device import SimulatedDevice
from tauscope_sim.device.server import DeviceServer, TraceWriter
from tauscope_sim.own_process import take_precedence
from tauscope_sim.scenario_file import read_scenario

READY = "ready"  # line on standard output once hosts can connect


def main(arguments: list[str] | None = None) -> int:
    """Run the device until it is asked to end, or until it has been alone for long enough."""
    options = _parser().parse_args(arguments)
    try:
        robot = _robot(options.robot)
        scenario = read_scenario(options.scenario, robot)
        start = None if options.start_position is None else _numbers(options.start_position, robot.joint_count)
        device = SimulatedDevice(robot, scenario, start_position=start, start_ns=time.monotonic_ns())
        trace = TraceWriter(options.trace, device)
        listener = _listener(options.socket)
    except (TauscopeError, OSError, argparse.ArgumentTypeError) as error:
        sys.stderr.write(f"error: {' '.join(str(error).split())}\n")
        return 1
    try:
        _serve(DeviceServer(device, listener, trace, options.linger))
    finally:
        listener.close()
        trace.close()
        with contextlib.suppress(FileNotFoundError):
            options.socket.unlink()
    return 0


def _serve(server: DeviceServer) -> None:
    signal.signal(signal.SIGTERM, lambda *_: server.finish())
    # Control-C is meant for the program in front, never for the arm
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.stdout.write(READY + "\n")
    sys.stdout.flush()
    # whoever started the device may go: nothing is written to them any longer
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
    take_precedence()
    server.run()


def _listener(path: Path) -> socket.socket:
    """Listen on a Unix socket that only this user may connect to; a path in use is refused, a dead one replaced."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        if path.is_socket() and not _answers(path):
            path.unlink()
        listener.bind(str(path))
        path.chmod(0o600)
    except OSError as error:
        listener.close()
        raise OSError(f"{path}: cannot listen there ({error.strerror or error}); choose another socket") from error
    listener.listen(4)
    return listener


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        return probe.connect_ex(str(path)) == 0


def _robot(path: Path) -> Robot:
    if path.suffix != ".json":
        return read_robot(path)
    try:
        return robot_from_dict(json.loads(path.read_text(encoding="utf-8")), str(path))
    except ValueError as error:
        if isinstance(error, TauscopeError):
            raise
        raise RobotFileError(f"{path}: not JSON ({error}); write it again") from error


def _numbers(text: str, count: int) -> list[float]:
    refusal = argparse.ArgumentTypeError(f"--start-position {text}: give a JSON list of {count} numbers")
    try:
        numbers = [float(number) for number in json.loads(text)]
    except (ValueError, TypeError):
        raise refusal from None
    if len(numbers) != count or not all(abs(number) < float("inf") for number in numbers):
        raise refusal
    return numbers


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tauscope_sim.device", description=__doc__)
    parser.add_argument("--robot", type=Path, required=True, metavar="FILE", help="robot file with a model block")
    parser.add_argument("--scenario", type=Path, metavar="FILE", help="scenario file; nothing is concealed without")
    parser.add_argument("--socket", type=Path, required=True, metavar="PATH", help="Unix socket to listen on")
    parser.add_argument(
        "--trace", type=Path, required=True, metavar="CSV", help="the device's own record; must not exist"
    )
    parser.add_argument("--start-position", metavar="LIST", help="where the arm stands, as a JSON list [rad or m]")
    parser.add_argument(
        "--linger", type=float, default=60.0, metavar="S", help="end after this long alone (default 60)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
