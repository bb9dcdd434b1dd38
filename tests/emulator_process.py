"""Starts an emulator in a process of its own and talks to it."""

import json
import os
import socket
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

from tauscope_sim.emulation.emulator import EmulatorOrder
from tauscope_sim.emulation.fault_kit import InjectedFault
from tauscope_sim.own_process import process_environment

_ANSWER_TIMEOUT_S = 10.0


_Order = TypeVar("_Order", bound=EmulatorOrder)


class EmulatorProcess(Generic[_Order]):
    """An emulator that lives as long as the ``with`` block, or as the process that started it."""

    def __init__(self, order: _Order) -> None:
        """Nothing is started yet."""
        self.order = order
        self._process: subprocess.Popen[bytes] | None = None
        self._socket: socket.socket | None = None
        self._received = b""

    def __enter__(self) -> Self:
        command = [sys.executable, "-m", "tauscope_sim.emulation.server", self.order.kind, self.order.to_json()]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=_environment(), start_new_session=True
        )
        assert self._process.stdout is not None
        if self._process.stdout.readline().strip() != b"ready":
            self.__exit__(None, None, None)
            raise RuntimeError("the emulator did not start; see what it wrote")
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(_ANSWER_TIMEOUT_S)
        self._socket.connect(self.order.control)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._socket is not None:
            self._socket.close()
        if self._process is not None:
            for stream in (self._process.stdin, self._process.stdout):
                if stream is not None:
                    stream.close()
            try:
                self._process.wait(timeout=_ANSWER_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    @property
    def pid(self) -> int:
        """Of the emulator's process."""
        if self._process is None:
            raise RuntimeError("the emulator was not started")
        return self._process.pid

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """A request to the emulator, and its state; see `Emulator.answer`."""
        if self._socket is None:
            raise RuntimeError("the emulator was not started")
        self._socket.sendall(json.dumps(request).encode() + b"\n")
        while b"\n" not in self._received:
            received = self._socket.recv(65_536)
            if not received:
                raise RuntimeError("the emulator is gone")
            self._received += received
        line, _, self._received = self._received.partition(b"\n")
        return json.loads(line)

    @property
    def state(self) -> dict[str, Any]:
        """What the devices are doing; see `Emulator.describe`."""
        return self.ask({})

    def inject(self, *faults: InjectedFault) -> None:
        """Set faults off."""
        self.ask({"inject": [asdict(fault) for fault in faults]})

    def get(self, device: int, place: str | tuple[int, int]) -> int:
        """What a device holds."""
        return self.ask({"get": [device, place]})["value"]

    def put(self, device: int, place: str | tuple[int, int], value: int) -> None:
        """Set what a device holds, behind the master's back."""
        self.ask({"put": [device, place, value]})

    def advance_to(self, instant_s: float) -> None:
        """Let the devices' time pass, where their order says that nothing else does.

        Parameters
        ----------
        instant_s : float
            by the devices' clock; nothing happens where that has passed [s]
        """
        self.ask({"advance_to": instant_s})

    def reset(self) -> None:
        """Begin anew, with a new trace, as if it had just been started; the master's port stays."""
        self.ask({"reset": True})

    def trace(self) -> list[dict[str, Any]]:
        """What the devices have done so far, one entry about every two milliseconds."""
        if self.order.trace is None:
            return []
        with Path(self.order.trace).open(encoding="utf-8") as file:
            # in one piece: the last line may be only half written
            *whole, _ = file.read().split("\n")
        return [json.loads(line) for line in whole]


def _environment() -> dict[str, str]:
    """That of a process of this tree, with the emulators that are tests' own."""
    environment = process_environment()
    tests = str(Path(__file__).resolve().parent)
    return environment | {"PYTHONPATH": os.pathsep.join([environment["PYTHONPATH"], tests])}
