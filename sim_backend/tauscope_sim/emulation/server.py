"""An emulator as a process: a port for the master, a socket for the test, a trace of what was done.

``python -m tauscope_sim.emulation.server MODULE:ORDER JSON``, until standard input ends.
"""

import contextlib
import json
import os
import select
import socket
import sys
import threading
import time
from importlib import import_module
from pathlib import Path
from typing import Any, Self

from tauscope_sim.emulation.emulator import MOST_STEPS, EmulatorOrder, Port
from tauscope_sim.own_process import take_precedence

_SWITCH_S = 5e-5  # how long the thread waits for the interpreter at most [s]
_AWAY_S = 0.001  # how often it is looked for a master that is not there [s]
_NICE = -20  # no real-time priority: what carries bytes through a pseudo terminal is a thread of the kernel without one


class Arrivals:
    """Bytes that a port has received, each piece with its instant, as long as the ``with`` block lasts."""

    def __init__(self, port: Port) -> None:
        self._port = port
        self._pieces: list[tuple[bytes, int]] = []
        self._lock = threading.Lock()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK)
        self._end = os.eventfd(0)
        self._thread = threading.Thread(target=self._receive, daemon=True)

    def __enter__(self) -> Self:
        sys.setswitchinterval(_SWITCH_S)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        os.eventfd_write(self._end, 1)
        self._thread.join()
        os.close(self._wake)
        os.close(self._end)

    def fileno(self) -> int:
        """Descriptor to wait on."""
        return self._wake

    def take(self) -> tuple[list[tuple[bytes, int]], int]:
        """What came since the last call, the oldest first, and the instant before which nothing more has come."""
        with contextlib.suppress(BlockingIOError):
            os.eventfd_read(self._wake)
        with self._lock:
            pieces, self._pieces = self._pieces, []
            return pieces, time.monotonic_ns()

    def _receive(self) -> None:
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        while self._end not in select.select([self._port, self._end], [], [])[0]:
            with self._lock:
                now_ns = time.monotonic_ns()
                received = self._port.read()
                if received:
                    self._pieces.append((received, now_ns))
            if received:
                os.eventfd_write(self._wake, 1)
            elif received is None and select.select([self._end], [], [], _AWAY_S)[0]:
                return


_PERIOD_S = 0.001
_TRACE_PERIOD_S = 0.002
_LONGEST_MESSAGE = 65_536
_ROUNDING_S = 1e-9  # what is due is not put off because a sum of steps falls short of it by its rounding
_AT_ONCE_S = 0.02  # where time is stepped, a master that waits lets none pass: what is due so soon arrives at once


class EmulatorServer:
    """Runs an emulator until its standard input ends, against the machine's clock or one that a test moves on."""

    def __init__(self, order: EmulatorOrder) -> None:
        self._order = order
        self._port = order.open_port()
        self._tests = _listen(order.control)
        self._test: socket.socket | None = None
        self._pending = b""
        self._trace = (
            None if order.trace is None else os.open(order.trace, os.O_CREAT | os.O_APPEND | os.O_WRONLY, 0o644)
        )
        self._begin()
        self._arrivals = None if order.stepped else Arrivals(self._port)
        self._running = True
        self._master_is_there = True

    def run(self) -> None:
        """Serve."""
        take_precedence()
        try:
            with self._arrivals or contextlib.nullcontext():
                print("ready", flush=True)  # noqa: T201 (whoever started this waits for the line)
                while self._running:
                    ready = self._wait()
                    self._serve_master()
                    self._serve_test(ready)
                    self._write_trace()
        finally:
            self._port.close()
            Path(self._order.control).unlink(missing_ok=True)

    def _begin(self) -> None:
        """Devices as delivered, the arm where it stands at first, the clock at zero, and a trace of only that."""
        self._emulator = self._order.build(0.0)
        self._start_ns = time.monotonic_ns()
        self._stepped_s = 0.0
        self._next_trace_s = 0.0
        if self._trace is not None:
            os.ftruncate(self._trace, 0)
        self._write_trace()

    @property
    def _now_s(self) -> float:
        return self._stepped_s if self._order.stepped else self._instant(time.monotonic_ns())

    def _wait(self) -> list[Any]:
        due_s = self._emulator.next_due_s
        if not self._order.stepped:
            due_s = min(due_s, self._emulator.now_s + _PERIOD_S)
        wait_s = min(_PERIOD_S, max(0.0, due_s - self._now_s))
        master = self._arrivals or (self._port if self._master_is_there else None)
        sources = [one for one in (self._tests, sys.stdin, master, self._test) if one is not None]
        ready = select.select(sources, [], [], wait_s)[0]
        if sys.stdin in ready and not os.read(sys.stdin.fileno(), 1):
            self._running = False
        return ready

    def _serve_master(self) -> None:
        """Take what the master sent, let time pass, send what is due: none waits for more than a step."""
        pieces, now_s = self._receive()
        for piece, arrival_s in pieces:
            if self._emulator.hears(self._port.baud):
                self._emulator.receive(piece, arrival_s)
        if pieces:
            self._send()
        self._emulator.advance_to(now_s, MOST_STEPS if self._order.stepped else 1)
        self._send()

    def _send(self) -> None:
        if arrived := self._emulator.due(self._now_s + (_AT_ONCE_S if self._order.stepped else 0.0)):
            self._port.write(arrived)

    def _receive(self) -> tuple[list[tuple[bytes, float]], float]:
        if self._arrivals is not None:
            pieces, until_ns = self._arrivals.take()
            return [(piece, self._instant(at_ns)) for piece, at_ns in pieces], self._instant(until_ns)
        piece = self._port.read()
        self._master_is_there = piece is not None
        return [(piece, self._stepped_s)] if piece else [], self._stepped_s

    def _instant(self, monotonic_ns: int) -> float:
        return max(0.0, (monotonic_ns - self._start_ns) * 1e-9)

    def _serve_test(self, ready: list[Any]) -> None:
        """Answer the test, a line of JSON each way."""
        if self._tests in ready:
            self._test = self._tests.accept()[0]
            self._test.setblocking(False)
            return
        if self._test is None or self._test not in ready:
            return
        received = self._test.recv(_LONGEST_MESSAGE)
        if not received:
            self._test, self._pending = None, b""
            return
        *lines, self._pending = (self._pending + received).split(b"\n")
        for line in lines:
            request = json.loads(line)
            if "advance_to" in request:
                # what the master sent before that came before, and what is due comes before the answer
                self._serve_master()
                self._step_to(request["advance_to"])
                self._send()
            if "reset" in request:
                self._begin()
            answer = self._emulator.answer(request) or self._describe()
            self._test.setblocking(True)
            self._test.sendall(json.dumps(answer).encode() + b"\n")
            self._test.setblocking(False)

    def _step_to(self, instant_s: float) -> None:
        while self._stepped_s < instant_s:
            self._stepped_s = min(instant_s, self._stepped_s + _PERIOD_S)
            self._emulator.advance_to(self._stepped_s + _ROUNDING_S)
            self._write_trace()

    def _describe(self) -> dict[str, Any]:
        return {**self._emulator.describe(), "monotonic_ns": time.monotonic_ns()}

    def _write_trace(self) -> None:
        """Append where the arm is, one JSON line at a time; a line is whole or not there."""
        if self._trace is None or self._emulator.now_s + _ROUNDING_S < self._next_trace_s:
            return
        self._next_trace_s = self._emulator.now_s + _TRACE_PERIOD_S
        os.write(self._trace, json.dumps(self._describe()).encode() + b"\n")


def _listen(path: str) -> socket.socket:
    Path(path).unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(1)
    listener.setblocking(False)
    return listener


if __name__ == "__main__":
    module, _, name = sys.argv[1].partition(":")
    EmulatorServer(getattr(import_module(module), name).from_json(sys.argv[2])).run()
