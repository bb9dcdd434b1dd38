"""Runs in an emulator's own time that something happens to, just before one of their calls."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from emulator_process import EmulatorProcess
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import Connection
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.run import run_trajectory
from tauscope.trajectory import Trajectory
from tauscope_drivers import ArmState, Backend, Capabilities, ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_drivers.clock import Clock
from tauscope_sim.emulation.emulator import EmulatorOrder

PHASES = ("connect", "enable", "ramp", "run", "stop")
_RAMP_CYCLES = 5
_RUN_CYCLES = 120


class Disturbed:
    """A backend, with something that happens just before one of its calls."""

    def __init__(self, backend: Backend, phase: str, happen: Callable[[], object]) -> None:
        self._backend, self._phase, self._happen = backend, phase, happen
        self._cycle = 0

    @property
    def capabilities(self) -> Capabilities:
        return self._backend.capabilities

    @property
    def clock(self) -> Clock:
        return self._backend.clock

    def connect(self) -> ArmState:
        self._strike("connect")
        return self._backend.connect()

    def acknowledge_faults(self) -> ArmState:
        return self._backend.acknowledge_faults()

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        self._strike("enable")
        return self._backend.enable(mode, limits, stop_policy, watchdog_s, cycle_s)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        self._cycle += 1
        if self._cycle == _RAMP_CYCLES:
            self._strike("ramp")
        if self._cycle == _RUN_CYCLES:
            self._strike("run")
        return self._backend.exchange(setpoint)

    def stop(self, policy: StopPolicy) -> ArmState:
        self._strike("stop")
        return self._backend.stop(policy)

    def disconnect(self) -> None:
        self._backend.disconnect()

    def _strike(self, phase: str) -> None:
        if phase == self._phase:
            self._phase = ""
            self._happen()


@dataclass
class Site:
    """An emulated arm, a motion for it, and a folder for runs."""

    emulator: EmulatorProcess
    robot: Robot
    motion: Trajectory
    folder: Path

    def run(self, arm: Backend, name: str, backend_name: str) -> tuple[RunRecord, Path]:
        """A run in the emulator's own time."""
        folder = self.folder / f"{len(list(self.folder.iterdir()))}-{name}"
        options = RunOptions(rate_hz=100.0, watchdog_s=0.2, least_kept=0.0)
        connect = lambda: Connection(arm, is_real_time=False)  # noqa: E731
        return run_trajectory(self.robot, self.motion, connect, folder, options, backend_name=backend_name), folder


@contextmanager
def fault_site(robot_file: Path, order_of: Callable[[Robot, tuple[float, ...]], EmulatorOrder]) -> Iterator[Site]:
    """The arm of a robot file, near the start of a short motion; the order is the bus's matter. Runs lie beside it."""
    robot = read_robot(robot_file)
    design = ExcitationOptions(period_s=2.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    with EmulatorProcess(order_of(robot, tuple((motion.start + 0.1).tolist()))) as emulator:
        yield Site(emulator, robot, motion, robot_file.parent)
