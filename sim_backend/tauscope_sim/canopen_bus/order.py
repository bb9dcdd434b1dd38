"""The order that starts emulated drives as a process, as JSON."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope.robot import read_robot
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile, read_device_file
from tauscope_sim.canopen_bus.drive import AxisScale, EmulatedDrive
from tauscope_sim.canopen_bus.driven_arm import DrivenArm
from tauscope_sim.canopen_bus.emulator import CanEmulator
from tauscope_sim.canopen_bus.lines import CanSocket, SerialLine, SocketLine
from tauscope_sim.emulation.emulator import STEP_S, EmulatorOrder, Port
from tauscope_sim.scenario import Scenario
from tauscope_sim.scenario_file import read_scenario

_SOCKET = "socketcan:"


@dataclass(frozen=True)
class CanOrder(EmulatorOrder):
    """What to emulate.

    `start`: where the joints stand [rad or m].
    `rated_torque_mnm`: object 0x6076 of each drive, at the motor shaft [mNm].
    `torque_noise`: standard deviation of what the drives measure of the torque [Nm or N].
    `bit_rate`: of the bus [bit/s].
    """

    robot: str
    start: tuple[float, ...]
    port: str
    control: str
    rated_torque_mnm: tuple[int, ...]
    scenario: str | None = None
    torque_noise: float = 0.0
    bit_rate: int = 1_000_000
    stepped: bool = False
    trace: str | None = None

    def open_port(self) -> Port:
        """A serial adapter on a pseudo terminal, or the kernel's CAN bus."""
        return super().open_port() if self._interface is None else CanSocket(self._interface)

    def build(self, now_s: float) -> CanEmulator:
        """The emulator."""
        robot = read_robot(Path(self.robot))
        scenario = Scenario() if self.scenario is None else read_scenario(Path(self.scenario), robot)
        drives = []
        for joint, rated in zip(robot.joints, self.rated_torque_mnm, strict=True):
            block, ratio = joint.drive or {}, joint.gear_ratio or 1.0
            turns = block["counts_per_turn"] * ratio * block.get("direction", 1)
            scale = AxisScale(turns / (2.0 * math.pi), rated, abs(ratio))
            drives.append(EmulatedDrive(block["node_id"], scale, self._file(block)))
        driven = DrivenArm(drives, robot, scenario, self.start, STEP_S, self.torque_noise)
        # the kernel's virtual bus and a stepped clock take their time by themselves
        bit_rate = math.inf if self.stepped or self._interface is not None else self.bit_rate
        line = SerialLine() if self._interface is None else SocketLine()
        return CanEmulator(drives, driven, now_s, bit_rate, line)

    def _file(self, block: Mapping[str, Any]) -> DeviceFile | None:
        eds = block.get("eds")
        return None if eds is None else read_device_file(Path(self.robot).parent / eds, block["node_id"])

    @property
    def _interface(self) -> str | None:
        return self.port.removeprefix(_SOCKET) if self.port.startswith(_SOCKET) else None
