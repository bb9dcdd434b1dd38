"""The conformance suite's rig of an arm of emulated Dynamixel servos: the paper's arm, in a process of its own."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import sim_backend.examples
from arm_rigs import START, Rig, Watched
from drivers import Backend
from drivers.dynamixel import DynamixelArm, DynamixelJoint
from service.robot import read_robot
from sim_backend.device import Disturbance, Injection
from sim_backend.dynamixel_bus import EmulatorOrder, EmulatorProcess, FaultKind, InjectedFault, ServoSpecification

ROBOT = Path(sim_backend.examples.__file__).with_name("paper_arm.yaml")
TORQUE_PER_MILLIAMPERE = 0.005
PATIENCE_S = 20.0
SLACK_S = 0.03
GLANCE_S = 0.002

_KINDS = {
    Disturbance.LOST_SAMPLE: FaultKind.SILENT,
    Disturbance.OVER_TEMPERATURE: FaultKind.OVER_TEMPERATURE,
    Disturbance.OVERLOAD: FaultKind.OVERLOAD,
}


class DynamixelRig:
    """`DynamixelArm` on three PH54 servos; the onlooker reads the emulator's trace."""

    position_resolution = 2.0 * np.pi / 1_003_846
    torque_resolution = TORQUE_PER_MILLIAMPERE
    swing = 0.01
    is_real_time = True

    def __init__(self, emulator: EmulatorProcess) -> None:
        self.robot = read_robot(ROBOT)
        self.backend: Backend = _arm(emulator)
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
        """An error of a servo ends when somebody switches it off and on, which happens at its end."""
        seconds = (injection.duration_ns or 0) * 1e-9
        faults = [InjectedFault(_KINDS[injection.kind], injection.joint, seconds=seconds)]
        if injection.kind is not Disturbance.LOST_SAMPLE and seconds:
            faults.append(InjectedFault(FaultKind.RESET, injection.joint, at_s=seconds, seconds=0.01))
        self._emulator.inject(faults)
        self.watch(0.01)

    def torque(self, effort: np.ndarray) -> np.ndarray:
        return TORQUE_PER_MILLIAMPERE * effort

    def another_host(self) -> Backend:
        return _arm(self._emulator)

    def _trace_until(self, instant_ns: int) -> list[dict[str, Any]]:
        deadline = time.monotonic() + PATIENCE_S
        while (trace := self._emulator.trace())[-1]["monotonic_ns"] < instant_ns:
            assert time.monotonic() < deadline, "the emulator's trace does not go on"
            time.sleep(GLANCE_S)
        return trace


def _arm(emulator: EmulatorProcess) -> DynamixelArm:
    drives = [{"id": number, "port": emulator.order.port} for number in (1, 2, 3)]
    joints = [DynamixelJoint(f"joint{drive['id']}", drive, TORQUE_PER_MILLIAMPERE) for drive in drives]
    return DynamixelArm(joints, slack_s=SLACK_S)


@contextmanager
def dynamixel_rigs(folder: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs that share one emulator process; before each of them the servos are as delivered."""
    servos = tuple(
        ServoSpecification(number, 2020, torque_per_milliampere=TORQUE_PER_MILLIAMPERE) for number in (1, 2, 3)
    )
    order = EmulatorOrder(
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
