"""Emulated drives on python-can's virtual bus, each moving a joint that follows its target at once."""

import math
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from uuid import uuid4

import can

from tauscope_drivers.canopen.data_sheet.device_file import read_device_file
from tauscope_drivers.drive_block import DriveJoint
from tauscope_sim.canopen_bus.drive import REMOTE, AxisMode, AxisScale, EmulatedDrive

GEAR = 50.0
COUNTS_PER_TURN = 65536
RATED_TORQUE_MNM = 500
START = (0.3, -0.2, 0.1)


class EmulatedBus:
    """Drives in a thread of their own, on a bus of this process."""

    def __init__(self, files: Sequence[Path | None] = (None, None, None)) -> None:
        """Drives with the objects of EDS or DCF files, or with all of them."""
        self.files = files
        self.channel = uuid4().hex
        scale = AxisScale(COUNTS_PER_TURN * GEAR / (2.0 * math.pi), RATED_TORQUE_MNM, GEAR)
        sheets = [None if path is None else read_device_file(path, number) for number, path in enumerate(files, 1)]
        self.drives = [EmulatedDrive(number, scale, sheet) for number, sheet in enumerate(sheets, 1)]
        self.position = list(START[: len(files)])
        self.furthest = [0.0] * len(files)
        self.deaf = False
        """whether the master misses the process data"""
        self.swallows: Callable[[can.Message], bool] = lambda _: False
        self._ends = threading.Event()
        self._bus = can.Bus(interface="virtual", channel=self.channel)
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> "EmulatedBus":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()
        self._bus.shutdown()

    def joints(self) -> list[DriveJoint]:
        bus = {"interface": "virtual", "channel": self.channel}
        drives = [
            {"node_id": number, "counts_per_turn": COUNTS_PER_TURN} | ({} if path is None else {"eds": str(path)})
            for number, path in enumerate(self.files, 1)
        ]
        return [
            DriveJoint(f"joint{n}", drive | (bus if n == 1 else {}), gear_ratio=GEAR)
            for n, drive in enumerate(drives, 1)
        ]

    def _serve(self) -> None:
        while not self._ends.is_set():
            message = self._bus.recv(0.001)
            now = time.monotonic()
            for index, drive in enumerate(self.drives):
                self._move(index, drive)
                answers = drive.tick(now)
                if message is not None and not self.swallows(message):
                    identifier = message.arbitration_id | (REMOTE if message.is_remote_frame else 0)
                    answers += drive.receive((identifier, bytes(message.data)), now)
                for identifier, data in answers:
                    if self.deaf and 0x180 <= identifier < 0x500:
                        continue
                    self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _move(self, index: int, drive: EmulatedDrive) -> None:
        demand = drive.demand()
        if demand.mode is AxisMode.POSITION:
            self.position[index] = demand.position
        self.furthest[index] = max(self.furthest[index], abs(self.position[index] - START[index]))
        drive.measure(self.position[index], 0.0, 1.5)
