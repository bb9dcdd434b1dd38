"""Starts an emulator in a process of its own and talks to it."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from sim_backend.emulation.emulator import EmulatorOrder

_ANSWER_TIMEOUT_S = 10.0
_TREE = Path(__file__).resolve().parents[2]


class EmulatorProcess:
    """An emulator that lives as long as the ``with`` block, or as the process that started it."""

    def __init__(self, module: str, order: EmulatorOrder) -> None:
        """Nothing is started yet.

        Parameters
        ----------
        module : str
            what runs as the process: the package of the bus
        order : EmulatorOrder
            what to emulate
        """
        self.order = order
        self._module = module
        self._process: subprocess.Popen[bytes] | None = None
        self._socket: socket.socket | None = None
        self._received = b""
        self._trace_start = 0

    def __enter__(self) -> Self:
        command = [sys.executable, "-m", self._module, self.order.to_json()]
        path = os.pathsep.join(filter(None, [str(_TREE), os.environ.get("PYTHONPATH")]))
        # One thread: the matrices are small, and the control loop needs the other cores.
        environment = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self._process = subprocess.Popen(  # noqa: S603 (our own module with our own arguments)
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, start_new_session=True
        )
        assert self._process.stdout is not None  # noqa: S101 (a pipe was asked for)
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
        """A request to the emulator, and its state; see `Emulator.answer`.

        Parameters
        ----------
        request : dict
            plain data
        """
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

    def inject(self, *faults: dict[str, Any]) -> None:
        """Set faults off; their instants (``after_s``) count from now.

        Parameters
        ----------
        *faults : dict
            fields of `InjectedFault`
        """
        self.ask({"inject": list(faults)})

    def reset(self) -> None:
        """Begin anew, as if it had just been started; the master's port stays."""
        self.ask({"reset": True})
        if self.order.trace is not None:
            self._trace_start = Path(self.order.trace).stat().st_size

    def trace(self) -> list[dict[str, Any]]:
        """What the device has done so far, one entry about every two milliseconds."""
        if self.order.trace is None:
            return []
        with Path(self.order.trace).open(encoding="utf-8") as file:
            file.seek(self._trace_start)
            # in one piece: the last line may be only half written
            *whole, _ = file.read().split("\n")
        return [json.loads(line) for line in whole]
