"""The emulator as a process: a pseudo terminal for the master, a socket for the test, a trace of what was done."""

import contextlib
import json
import os
import select
import socket
import sys
import time
from pathlib import Path
from typing import Any

from sim_backend.dynamixel_bus.emulator import Emulator
from sim_backend.dynamixel_bus.fault_kit import FaultKind, InjectedFault
from sim_backend.dynamixel_bus.order import EmulatorOrder
from sim_backend.dynamixel_bus.pseudo_terminal import PseudoTerminal

_PERIOD_S = 0.001
_TRACE_PERIOD_S = 0.002
_LONGEST_MESSAGE = 65_536
_PRIORITY = 40
_ROUNDING_S = 1e-9
_AT_ONCE_S = 0.02
"""Where time is stepped, a master that waits lets none pass: what is due so soon arrives at once."""


class EmulatorServer:
    """Runs an emulator against the machine's clock until its standard input ends."""

    def __init__(self, order: EmulatorOrder) -> None:
        """Open everything.

        Parameters
        ----------
        order : EmulatorOrder
            what to emulate
        """
        self._order = order
        self._begin()
        self._baud = {servo.specification.baud for servo in self._emulator.servos}
        self._terminal = PseudoTerminal()
        self._tests = _listen(order.control)
        self._test: socket.socket | None = None
        self._pending = b""
        self._trace = (
            None if order.trace is None else os.open(order.trace, os.O_CREAT | os.O_APPEND | os.O_WRONLY, 0o644)
        )
        self._running = True
        self._master_is_there = True
        _link(order.port, self._terminal.path)

    def run(self) -> None:
        """Serve."""
        _ask_for_real_time()
        print("ready", flush=True)  # noqa: T201 (whoever started this waits for the line)
        try:
            while self._running:
                self._wait()
                self._serve_master()
                self._serve_test()
                self._write_trace()
        finally:
            self._terminal.close()
            for path in (self._order.port, self._order.control):
                Path(path).unlink(missing_ok=True)

    def _begin(self) -> None:
        """Servos as delivered, the arm where it stands at first, the clock at zero."""
        self._emulator = self._order.build(0.0)
        self._start_ns = time.monotonic_ns()
        self._stepped_s = 0.0
        self._next_trace_s = 0.0

    @property
    def _now_s(self) -> float:
        return self._stepped_s if self._order.stepped else (time.monotonic_ns() - self._start_ns) * 1e-9

    def _wait(self) -> None:
        """Until something comes, an answer is due, or the physics want their step."""
        wait_s = min(_PERIOD_S, max(0.0, self._emulator.next_due_s - self._now_s))
        sources: list[Any] = [self._tests, sys.stdin]
        if self._master_is_there:
            sources.append(self._terminal)
        if self._test is not None:
            sources.append(self._test)
        ready = select.select(sources, [], [], wait_s)[0]
        if sys.stdin in ready and not os.read(sys.stdin.fileno(), 1):
            self._running = False

    def _serve_master(self) -> None:
        """Take what the master sent, let time pass, send what has arrived at the master."""
        received = self._terminal.read()
        self._master_is_there = received is not None
        if received and self._terminal.baud in self._baud:
            self._emulator.receive(received, self._now_s)
        self._emulator.advance_to(self._now_s)
        if arrived := self._emulator.due(self._now_s + (_AT_ONCE_S if self._order.stepped else 0.0)):
            self._terminal.write(arrived)

    def _serve_test(self) -> None:
        """Answer the test, a line of JSON each way."""
        with contextlib.suppress(BlockingIOError):
            self._test = self._tests.accept()[0]
            self._test.setblocking(False)
        if self._test is None:
            return
        try:
            received = self._test.recv(_LONGEST_MESSAGE)
        except BlockingIOError:
            return
        if not received:
            self._test, self._pending = None, b""
            return
        *lines, self._pending = (self._pending + received).split(b"\n")
        for line in lines:
            request = json.loads(line)
            if "advance_to" in request:
                self._step_to(request["advance_to"])
            if "reset" in request:
                self._begin()
                if self._trace is not None:
                    os.ftruncate(self._trace, 0)
            answer = answer_request(self._emulator, request) or self._describe()
            self._test.setblocking(True)
            self._test.sendall(json.dumps(answer).encode() + b"\n")
            self._test.setblocking(False)

    def _step_to(self, instant_s: float) -> None:
        """Let time pass where only that makes it pass."""
        while self._stepped_s < instant_s:
            self._stepped_s = min(instant_s, self._stepped_s + _PERIOD_S)
            # A step is due although the sum of steps falls short of it by its rounding.
            self._emulator.advance_to(self._stepped_s + _ROUNDING_S)
            self._write_trace()

    def _describe(self) -> dict[str, Any]:
        """What the device is doing, and when, by the machine's clock."""
        return {**describe(self._emulator), "monotonic_ns": time.monotonic_ns()}

    def _write_trace(self) -> None:
        """Append where the device is, one JSON line at a time; a line is whole or not there."""
        if self._trace is None or self._emulator.now_s < self._next_trace_s:
            return
        self._next_trace_s = self._emulator.now_s + _TRACE_PERIOD_S
        os.write(self._trace, json.dumps(self._describe()).encode() + b"\n")


def describe(emulator: Emulator) -> dict[str, Any]:
    """What the device is doing, as plain data.

    Parameters
    ----------
    emulator : Emulator
        of which
    """
    position, velocity = emulator.arm.motion
    servos = emulator.servos
    return {
        "time": emulator.now_s,
        "position": position.tolist(),
        "velocity": velocity.tolist(),
        "torque": emulator.torque.tolist(),
        "enabled": [servo.has_torque for servo in servos],
        "latched": [servo.memory.is_latched for servo in servos],
        "commanded": [servo.is_commanded for servo in servos],
        "latched_at": [servo.latched_s for servo in servos],
        "error": [servo.hardware_error for servo in servos],
        "on_stand": emulator.stands_on_stand,
        "lost": emulator.lost_s,
    }


def answer_request(emulator: Emulator, request: dict[str, Any]) -> dict[str, int] | None:
    """Do what a test asks. Returns ``{"value": …}`` for ``get``, else nothing.

    Parameters
    ----------
    emulator : Emulator
        with which
    request : dict
        ``{"inject": [{kind, servo, after_s, …}]}``, ``{"get": [servo, item]}``, ``{"put": [servo, item, value]}``,
        ``{"stand": bool}`` (put the stand under it, or take it away), or ``{}``; ``reset`` and ``advance_to`` are the
        server's own
    """
    if "inject" in request:
        emulator.bus.schedule.add(_fault(emulator, document) for document in request["inject"])
        emulator.bus.run_faults(emulator.now_s)
    elif "get" in request:
        servo, item = request["get"]
        return {"value": emulator.bus.servos[servo].memory.get(item)}
    elif "put" in request:
        servo, item, value = request["put"]
        emulator.bus.servos[servo].memory.put(item, value)
    elif "stand" in request:
        emulator.stands_on_stand = request["stand"]
    return None


def _fault(emulator: Emulator, document: dict[str, Any]) -> InjectedFault:
    at_s = emulator.now_s + document.pop("after_s", 0.0)
    return InjectedFault(**{**document, "kind": FaultKind(document["kind"])}, at_s=at_s)


def _ask_for_real_time() -> None:
    """Servos do not wait for other programs; where the system does not permit that, the machine has to be quiet."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_PRIORITY))


def _listen(path: str) -> socket.socket:
    Path(path).unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(1)
    listener.setblocking(False)
    return listener


def _link(path: str, target: str) -> None:
    """Point a path at the pseudo terminal, in place of an older one."""
    temporary = f"{path}.{os.getpid()}"
    os.symlink(target, temporary)
    os.replace(temporary, path)
