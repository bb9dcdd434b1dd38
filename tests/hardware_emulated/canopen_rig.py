"""The conformance suite's rig of an arm of emulated CiA 402 drives: the paper's arm, behind a serial CAN adapter."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import sim_backend.examples
from arm_rigs import START, Rig, Watched
from drivers import Backend
from drivers.canopen.configuration import DriveJoint
from drivers.canopen.driver import CanopenArm
from hardware_emulated.canopen_robot import COUNTS_PER_TURN, GEAR, RATED_TORQUE_MNM, write_canopen_robot
from service.robot import read_robot
from sim_backend.canopen_bus.order import CanOrder
from sim_backend.device import Disturbance, Injection
from sim_backend.dynamixel_bus.fault_kit import FaultKind
from sim_backend.emulation.process import EmulatorProcess

PATIENCE_S = 20.0
ANSWER_PATIENCE_S = 0.03
"""The machine of a test may be busy."""

_KINDS = {
    Disturbance.LOST_SAMPLE: FaultKind.SILENT,
    Disturbance.OVER_TEMPERATURE: FaultKind.OVER_TEMPERATURE,
    Disturbance.OVERLOAD: FaultKind.OVERLOAD,
}


class CanopenRig:
    """`CanopenArm` on three drives; the onlooker reads the emulator's trace."""

    position_resolution = 2.0 * np.pi / (COUNTS_PER_TURN * GEAR)
    torque_resolution = RATED_TORQUE_MNM * 1e-6 * GEAR
    swing = 0.0
    is_real_time = True

    def __init__(self, emulator: EmulatorProcess, robot: Path) -> None:
        self.robot = read_robot(robot)
        self.backend: Backend = self._arm()
        self._emulator = emulator

    def watch(self, duration_s: float) -> Watched:
        clock = self.backend.clock
        begin = clock.now_ns()
        end = begin + round(duration_s * 1e9)
        clock.wait_until_ns(end)
        rows = [entry for entry in self._trace_until(end) if begin <= entry["monotonic_ns"] <= end]
        return Watched(
            np.array([entry["monotonic_ns"] for entry in rows]),
            np.array([entry["position"] for entry in rows]),
            np.array([entry["velocity"] for entry in rows]),
            np.array([any(entry["commanded"]) for entry in rows]),
        )

    def look(self) -> np.ndarray:
        return np.array(self._trace_until(self.backend.clock.now_ns())[-1]["position"])

    def inject(self, injection: Injection) -> None:
        seconds = (injection.duration_ns or 0) * 1e-9
        self._emulator.inject({"kind": _KINDS[injection.kind], "servo": injection.joint, "seconds": seconds})
        self.watch(0.01)

    def disturb(self, **fault: Any) -> None:
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
        joints = [DriveJoint(joint.name, GEAR, joint.drive or {}) for joint in self.robot.joints]
        return CanopenArm(joints, patience_s=ANSWER_PATIENCE_S)

    def _trace_until(self, instant_ns: int) -> list[dict[str, Any]]:
        deadline = time.monotonic() + PATIENCE_S
        while (trace := self._emulator.trace())[-1]["monotonic_ns"] < instant_ns:
            assert time.monotonic() < deadline, "the emulator's trace does not go on"
        return trace


@contextmanager
def canopen_rigs(folder: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs of one emulator process; its drives are as delivered before each of them."""
    robot = write_canopen_robot(Path(sim_backend.examples.__file__).with_name("paper_arm.yaml"), folder)
    order = CanOrder(
        robot=str(robot),
        start=tuple(START.tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        rated_torque_mnm=(RATED_TORQUE_MNM,) * len(START),
        trace=str(folder / "trace"),
    )
    rigs: list[CanopenRig] = []
    with EmulatorProcess("sim_backend.canopen_bus", order) as emulator:

        def rig() -> Rig:
            while rigs:
                rigs.pop().backend.disconnect()
            emulator.reset()
            rigs.append(CanopenRig(emulator, robot))
            return rigs[-1]

        yield rig
