"""The conformance suite's rig of an arm of emulated CiA 402 drives: the paper's arm, behind a serial CAN adapter."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import tauscope_sim.examples
from arm_rigs import START, Rig, Watched
from emulator_process import EmulatorProcess
from hardware_emulated.canopen_robot import COUNTS_PER_TURN, GEAR, RATED_TORQUE_MNM, drive_joints, write_canopen_robot
from hardware_emulated.emulated_rig import FAULTS, EmulatedRig
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.robot import read_robot
from tauscope_drivers import Backend
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_sim.canopen_bus.emulator import CanOrder
from tauscope_sim.device import Injection
from tauscope_sim.emulation.fault_kit import InjectedFault

ANSWER_PATIENCE_S = 0.03
"""The machine of a test may be busy."""

STEPPED_PATIENCE_S = 0.1


class CanopenRig(EmulatedRig):
    """`CanopenArm` on three drives; the onlooker reads the emulator's trace."""

    position_resolution = 2.0 * np.pi / (COUNTS_PER_TURN * GEAR)
    torque_resolution = RATED_TORQUE_MNM * 1e-6 * GEAR
    swing = 0.0
    tells_temperature = False

    def __init__(self, emulator: EmulatorProcess, robot: Path) -> None:
        super().__init__(emulator)
        self.robot = read_robot(robot)
        self.backend: Backend = self._arm()

    def inject(self, injection: Injection) -> None:
        seconds = (injection.duration_ns or 0) * 1e-9
        self._emulator.inject(InjectedFault(FAULTS[injection.kind], injection.joint, seconds=seconds))
        self.watch(0.01)

    def disturb(self, fault: InjectedFault) -> None:
        """Set a fault of the kit off."""
        self._emulator.inject(fault)

    def drive_states(self) -> list[str]:
        """Power states of the drives."""
        return self._emulator.state["state"]

    def torque(self, effort: np.ndarray) -> np.ndarray:
        return effort

    def another_host(self) -> Backend:
        return self._arm()

    def _arm(self) -> CanopenArm:
        return CanopenArm(drive_joints(self.robot), patience_s=ANSWER_PATIENCE_S)


class SteppedCanopenRig(CanopenRig):
    """The same in a time that passes only when it is told to: frames go over the bus, but nobody is in a hurry."""

    is_real_time = False

    def __init__(self, emulator: EmulatorProcess, robot: Path) -> None:
        self._clock = SteppedClock(emulator)
        super().__init__(emulator, robot)

    def watch(self, duration_s: float) -> Watched:
        begin = self._clock.now_ns()
        self._clock.wait_until_ns(begin + round(duration_s * 1e9))
        rows = [entry for entry in self._emulator.trace() if round(entry["time"] * 1e9) > begin]
        return Watched(
            np.array([round(entry["time"] * 1e9) for entry in rows]),
            np.array([entry["position"] for entry in rows]),
            np.array([entry["velocity"] for entry in rows]),
            np.array([any(entry["commanded"]) for entry in rows]),
        )

    def look(self) -> np.ndarray:
        return np.array(self._emulator.state["position"])

    def _arm(self) -> CanopenArm:
        return CanopenArm(drive_joints(self.robot), patience_s=STEPPED_PATIENCE_S, clock=self._clock)


@contextmanager
def canopen_rigs(
    folder: Path, interface: str | None = None, *, stepped: bool = False, answers_within: int = 1
) -> Iterator[Callable[[], Rig]]:
    """Rigs of one emulator process; its drives are as delivered before each of them.

    They are behind a serial adapter, or on an interface of SocketCAN; time is the machine's, or stepped.
    """
    robot = write_canopen_robot(Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml"), folder, interface)
    order = CanOrder(
        robot=str(robot),
        start=tuple(START.tolist()),
        port=str(folder / "port") if interface is None else f"socketcan:{interface}",
        control=str(folder / "control"),
        rated_torque_mnm=(RATED_TORQUE_MNM,) * len(START),
        trace=str(folder / "trace"),
        stepped=stepped,
    )
    kind = SteppedCanopenRig if stepped else CanopenRig
    rigs: list[CanopenRig] = []
    with EmulatorProcess(order) as emulator:

        def rig() -> Rig:
            while rigs:
                rigs.pop().backend.disconnect()
            emulator.reset()
            rigs.append(kind(emulator, robot))
            rigs[-1].answers_within = answers_within
            return rigs[-1]

        yield rig
