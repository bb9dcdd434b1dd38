"""Drives, the arm that they move, the wire and the adapter, and the order that starts them as a process."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope.robot import read_robot
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile, read_device_file
from tauscope_sim.canopen_bus.drive import AxisScale, EmulatedDrive
from tauscope_sim.canopen_bus.driven_arm import DrivenArm
from tauscope_sim.canopen_bus.lines import CanSocket, SerialLine, SocketLine, Wire
from tauscope_sim.canopen_bus.power_state import PowerState
from tauscope_sim.emulation.emulator import STEP_S, Emulator, EmulatorOrder, Port
from tauscope_sim.emulation.fault_kit import AnswerFaults, FaultKind, InjectedFault
from tauscope_sim.scenario_file import read_scenario

_TICKS_PER_MEASUREMENT = 10  # while nobody asks: a drive that has stopped has to see that it stands

_SYNC = 0x080
_OVER_TEMPERATURE, _OVERLOAD = 0x4310, 0x7121


class CanEmulator(Emulator):
    """An arm of emulated drives; the instants are those of the caller's clock."""

    arm: DrivenArm

    def __init__(
        self,
        drives: Sequence[EmulatedDrive],
        arm: DrivenArm,
        now_s: float,
        bit_rate: float,
        line: SerialLine | SocketLine,
    ) -> None:
        """Everything at rest. `bit_rate`: of the bus; infinite where frames shall arrive at once [bit/s]."""
        super().__init__(arm, now_s)
        self.drives = tuple(drives)
        self._wire = Wire(bit_rate)
        self._line = line
        self._answers = b""
        self._away_until_s = {drive.node_id: 0.0 for drive in drives}
        self._ailing: dict[int, tuple[int, float]] = {}
        self._stopped_s: list[float | None] = [None for _ in drives]

    @property
    def next_due_s(self) -> float:
        """When the next frame reaches the master [s]."""
        return self.now_s if self._answers else self._wire.arriving.next_s

    def hears(self, baud: int) -> bool:
        """Any rate: an adapter on USB takes no notice of it. `baud`: of the master's port [bit/s]."""
        return baud > 0

    def receive(self, data: bytes, now_s: float) -> None:
        """Take text of the host.

        Drives hear it before they catch up: it may have waited while this process slept, and its sleep is no silence of
        the master. SYNC is different: they sample when it comes, and the time of interpolation is counted from then.
        """
        frames, answers = self._line.take(data)
        self._answers += answers
        self.arm.measure()
        for frame in frames:
            self._wire.occupy(frame, now_s)
            if frame[0] == _SYNC:
                self.advance_to(now_s)
                self.arm.measure(min(1.0, max(0.0, (now_s - self.now_s) / STEP_S)))
            come_s = self.now_s
            for drive in self.drives:
                if self._is_there(drive, come_s):
                    self._wire.carry(drive.receive(frame, come_s), now_s)
            if frame[0] == _SYNC:
                self.arm.take_targets(now_s - self._clock.lost_s)
        self.advance_to(now_s)

    def due(self, now_s: float) -> bytes:
        """Text that has reached the host by now."""
        text, self._answers = self._answers, b""
        return text + b"".join(map(self._line.text, self._wire.arriving.take_due(now_s)))

    def describe(self) -> dict[str, Any]:
        """Where the arm is and what its drives do."""
        return super().describe() | {
            "torque": self.arm.torque.tolist(),
            "state": [drive.power.state.name for drive in self.drives],
            "commanded": [drive.power.state is PowerState.OPERATION_ENABLED for drive in self.drives],
            "stopped_at": self._stopped_s,
        }

    def inject(self, faults: list[InjectedFault]) -> None:
        """Plan faults, and carry out those that are due."""
        super().inject(faults)
        for drive in self.drives:
            self._let_ail(drive)

    def get(self, device: int, place: tuple[int, int]) -> int:
        """Value of an entry."""
        return self._drive(device).dictionary.get(*place)

    def put(self, device: int, place: tuple[int, int], value: int) -> None:
        """Set an entry."""
        self._drive(device).dictionary.put(place[0], value, place[1])

    def _step(self) -> None:
        now_s = self.now_s
        self._run_faults()
        self.arm.step(self._clock.tick)
        if self._clock.tick % _TICKS_PER_MEASUREMENT == 0:
            self.arm.measure()
        for place, drive in enumerate(self.drives):
            was_enabled = drive.power.state is PowerState.OPERATION_ENABLED
            self._let_ail(drive)
            is_there = self._is_there(drive, now_s)
            if is_there:
                drive.return_to_bus()
            frames = drive.tick(now_s)
            if was_enabled and drive.power.state is not PowerState.OPERATION_ENABLED:
                self._stopped_s[place] = now_s
            if is_there:
                self._wire.carry(frames, now_s)

    def _carry_out(self, fault: InjectedFault) -> None:
        until_s = self.now_s + fault.seconds
        is_everywhere = fault.kind is FaultKind.POWER_DIP or not fault.device
        for drive in self.drives if is_everywhere else [self._drive(fault.device)]:
            match fault.kind:
                case FaultKind.SILENT:
                    self._away_until_s[drive.node_id] = until_s
                case FaultKind.BUS_OFF:
                    drive.leave_bus()
                    self._away_until_s[drive.node_id] = until_s
                case FaultKind.RESET | FaultKind.POWER_DIP:
                    drive.power_up()
                    self._away_until_s[drive.node_id] = until_s
                case FaultKind.OVER_TEMPERATURE | FaultKind.OVERLOAD:
                    code = _OVERLOAD if fault.kind is FaultKind.OVERLOAD else _OVER_TEMPERATURE
                    self._ailing[drive.node_id] = code, until_s
                case FaultKind.ENCODER_JUMP:
                    slip = fault.counts / drive.scale.counts_per_radian
                    self.arm.encoder_offset[self.drives.index(drive)] += slip
                case _:
                    self._wire.faults[drive.node_id] = AnswerFaults(fault.kind, fault.count, fault.seconds)

    def _let_ail(self, drive: EmulatedDrive) -> None:
        """A drive goes into fault, again and again, as long as its cause persists."""
        code, until_s = self._ailing.get(drive.node_id, (0, 0.0))
        if not code:
            return
        if drive.power.state is not PowerState.FAULT:
            drive.fail(code)
        if self.now_s >= until_s:
            del self._ailing[drive.node_id]

    def _is_there(self, drive: EmulatedDrive, now_s: float) -> bool:
        return now_s >= self._away_until_s[drive.node_id]

    def _drive(self, node: int) -> EmulatedDrive:
        return next(drive for drive in self.drives if drive.node_id == node)


_SOCKET = "socketcan:"


@dataclass(frozen=True, kw_only=True)
class CanOrder(EmulatorOrder):
    """What to emulate."""

    robot: str
    rated_torque_mnm: tuple[int, ...]  # object 0x6076 of each drive, at the motor shaft [mNm]
    torque_noise: float = 0.0  # standard deviation of what the drives measure of the torque [Nm or N]
    bit_rate: int = 1_000_000  # of the bus [bit/s]

    def open_port(self) -> Port:
        """A serial adapter on a pseudo terminal, or the kernel's CAN bus."""
        return super().open_port() if self._interface is None else CanSocket(self._interface)

    def build(self, now_s: float) -> CanEmulator:
        """The emulator."""
        robot = read_robot(Path(self.robot))
        scenario = read_scenario(self.scenario, robot)
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
