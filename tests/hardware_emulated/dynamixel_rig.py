"""The conformance suite's rig of an arm of emulated Dynamixel servos: the paper's arm, in a process of its own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import tauscope_sim.examples
from arm_rigs import START, Rig
from emulator_process import EmulatorProcess
from hardware_emulated.emulated_rig import FAULTS, EmulatedRig
from tauscope.robot import read_robot
from tauscope_drivers import Backend
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_sim.device import Disturbance, Injection
from tauscope_sim.dynamixel_bus import DynamixelOrder, ServoSpecification
from tauscope_sim.emulation import FaultKind, InjectedFault

ROBOT = Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml")
TORQUE_PER_MILLIAMPERE = 0.005
SLACK_S = 0.03


class DynamixelRig(EmulatedRig):
    """`DynamixelArm` on three PH54 servos; the onlooker reads the emulator's trace."""

    position_resolution = 2.0 * np.pi / 1_003_846
    torque_resolution = TORQUE_PER_MILLIAMPERE
    swing = 0.01
    tells_temperature = True

    def __init__(self, emulator: EmulatorProcess) -> None:
        super().__init__(emulator)
        self.robot = read_robot(ROBOT)
        self.backend: Backend = _arm(emulator)

    def inject(self, injection: Injection) -> None:
        """An error of a servo ends when somebody switches it off and on, which happens at its end."""
        seconds = (injection.duration_ns or 0) * 1e-9
        faults = [InjectedFault(FAULTS[injection.kind], injection.joint, seconds=seconds)]
        if injection.kind is not Disturbance.LOST_SAMPLE and seconds:
            faults.append(InjectedFault(FaultKind.RESET, injection.joint, at_s=seconds, seconds=0.01))
        self._emulator.inject(*faults)
        self.watch(0.01)

    def torque(self, effort: np.ndarray) -> np.ndarray:
        return TORQUE_PER_MILLIAMPERE * effort

    def another_host(self) -> Backend:
        return _arm(self._emulator)


def _arm(emulator: EmulatorProcess) -> DynamixelArm:
    drives = [{"id": number, "port": emulator.order.port} for number in (1, 2, 3)]
    joints = [DriveJoint(f"joint{drive['id']}", drive, torque_per_unit=TORQUE_PER_MILLIAMPERE) for drive in drives]
    return DynamixelArm(joints, slack_s=SLACK_S)


@contextmanager
def dynamixel_rigs(folder: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs that share one emulator process; before each of them the servos are as delivered."""
    servos = tuple(
        ServoSpecification(number, 2020, torque_per_milliampere=TORQUE_PER_MILLIAMPERE) for number in (1, 2, 3)
    )
    order = DynamixelOrder(
        servos=servos,
        start=tuple(START.tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        robot=str(ROBOT),
        trace=str(folder / "trace"),
    )
    with EmulatorProcess(order) as emulator:

        def rig() -> Rig:
            emulator.reset()
            return DynamixelRig(emulator)

        yield rig
