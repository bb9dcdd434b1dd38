"""The conformance suite's rig of an arm of emulated STS3215 servos: the paper's arm, in a process of its own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import tauscope_sim.examples
from arm_rigs import START, Rig
from emulator_process import EmulatorProcess
from feetech_bus import FeetechOrder, ServoSpecification
from hardware_emulated.emulated_rig import FAULTS, EmulatedRig
from tauscope.robot import read_robot
from tauscope_drivers import Backend
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_sim.device import Disturbance, Injection
from tauscope_sim.emulation import FaultKind, InjectedFault

ROBOT = Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml")
TORQUE_PER_PERMILLE = 0.06
"""Servos that are strong enough for the paper's arm [Nm]."""

SLACK_S = 0.03


class FeetechRig(EmulatedRig):
    """`FeetechArm` on three servos; the onlooker reads the emulator's trace."""

    position_resolution = 2.0 * np.pi / 4096
    torque_resolution = TORQUE_PER_PERMILLE
    swing = 0.01
    tells_temperature = True
    has_watchdog = False

    def __init__(self, emulator: EmulatorProcess) -> None:
        super().__init__(emulator)
        self.robot = read_robot(ROBOT)
        self.backend: Backend = _arm(emulator)

    def inject(self, injection: Injection) -> None:
        """An alarm of a servo ends when somebody switches it off and on, which happens at its end."""
        seconds = (injection.duration_ns or 0) * 1e-9
        faults = [InjectedFault(FAULTS[injection.kind], injection.joint, seconds=seconds)]
        if injection.kind is not Disturbance.LOST_SAMPLE and seconds:
            faults.append(InjectedFault(FaultKind.RESET, injection.joint, at_s=seconds, seconds=0.01))
        self._emulator.inject(*faults)
        self.watch(0.01)

    def torque(self, effort: np.ndarray) -> np.ndarray:
        return TORQUE_PER_PERMILLE * effort

    def another_host(self) -> Backend:
        return _arm(self._emulator)


def _arm(emulator: EmulatorProcess) -> FeetechArm:
    drives = [{"servo_id": number, "port": emulator.order.port} for number in (1, 2, 3)]
    joints = [DriveJoint(f"joint{drive['servo_id']}", drive, torque_per_unit=TORQUE_PER_PERMILLE) for drive in drives]
    return FeetechArm(joints, slack_s=SLACK_S)


@contextmanager
def feetech_rigs(folder: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs that share one emulator process; before each of them the servos are as delivered, but answer at once."""
    quick = {"return_delay": 0}
    order = FeetechOrder(
        servos=tuple(
            ServoSpecification(number, torque_per_permille=TORQUE_PER_PERMILLE, registers=quick) for number in (1, 2, 3)
        ),
        start=tuple(START.tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        robot=str(ROBOT),
        trace=str(folder / "trace"),
    )
    with EmulatorProcess(order) as emulator:

        def rig() -> Rig:
            emulator.reset()
            return FeetechRig(emulator)

        yield rig
