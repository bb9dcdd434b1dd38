"""The conformance suite's rigs of arms of emulated servos: the paper's arm, in a process of its own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import tauscope_sim.examples
from arm_rigs import START, Rig
from emulator_process import EmulatorProcess
from hardware_emulated.emulated_rig import FAULTS, EmulatedRig
from hardware_emulated.servo_bench import SLACK_S
from hardware_emulated.servo_kinds import DYNAMIXEL, FEETECH, ServoKind
from tauscope.robot import read_robot
from tauscope_drivers import Backend
from tauscope_drivers.drive_block import DriveJoint
from tauscope_sim.device import Disturbance, Injection
from tauscope_sim.emulation import FaultKind, InjectedFault

ROBOT = Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml")


@dataclass(frozen=True)
class RiggedServos:
    """`torque_per_unit`: of servos that are strong enough for the paper's arm [Nm]."""

    kind: ServoKind
    id_key: str
    model: str | None
    torque_per_unit: float
    counts_per_turn: int
    has_watchdog: bool

    def make_arm(self, port: str) -> Backend:
        joints = [
            DriveJoint(f"joint{number}", {self.id_key: number, "port": port}, torque_per_unit=self.torque_per_unit)
            for number in (1, 2, 3)
        ]
        return self.kind.make_arm(joints, slack_s=SLACK_S)


PH54 = RiggedServos(DYNAMIXEL, "id", "PH54-200-S500", 0.005, 1_003_846, has_watchdog=True)
STS3215 = RiggedServos(FEETECH, "servo_id", None, 0.06, 4096, has_watchdog=False)


class ServoRig(EmulatedRig):
    """The driver on three servos; the onlooker reads the emulator's trace."""

    swing = 0.01
    tells_temperature = True

    def __init__(self, emulator: EmulatorProcess, servos: RiggedServos) -> None:
        super().__init__(emulator)
        self._servos = servos
        self.has_watchdog = servos.has_watchdog
        self.position_resolution = 2.0 * np.pi / servos.counts_per_turn
        self.torque_resolution = servos.torque_per_unit
        self.robot = read_robot(ROBOT)
        self.backend = servos.make_arm(emulator.order.port)

    def inject(self, injection: Injection) -> None:
        """An error of a servo ends when somebody switches it off and on, which happens at its end."""
        seconds = (injection.duration_ns or 0) * 1e-9
        faults = [InjectedFault(FAULTS[injection.kind], injection.joint, seconds=seconds)]
        if injection.kind is not Disturbance.LOST_SAMPLE and seconds:
            faults.append(InjectedFault(FaultKind.RESET, injection.joint, at_s=seconds, seconds=0.01))
        self._emulator.inject(*faults)
        self.watch(0.01)

    def torque(self, effort: np.ndarray) -> np.ndarray:
        return self._servos.torque_per_unit * effort

    def another_host(self) -> Backend:
        return self._servos.make_arm(self._emulator.order.port)


@contextmanager
def servo_rigs(folder: Path, servos: RiggedServos) -> Iterator[Callable[[], Rig]]:
    """Rigs that share one emulator process; before each of them the servos are as delivered."""
    robot = read_robot(ROBOT)
    drive = {"model": servos.model} if servos.model else {}
    joints = (
        replace(joint, torque_constant=servos.torque_per_unit, drive={"id": number, **drive})
        for number, joint in enumerate(robot.joints, 1)
    )
    order = servos.kind.order(
        replace(robot, joints=tuple(joints)),
        START.tolist(),
        folder,
        quick=True,
        robot=str(ROBOT),
        trace=str(folder / "trace"),
    )
    with EmulatorProcess(order) as emulator:

        def rig() -> Rig:
            emulator.reset()
            return ServoRig(emulator, servos)

        yield rig
