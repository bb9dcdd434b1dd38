"""Backends on the test bench: each with an onlooker who sees the arm itself, not what its drives say of it.

A new backend joins the conformance suite by a rig of its own, in ``tests/drivers/conftest.py``.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from arms import paper_arm, paper_parameters
from device_trace import read_trace
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, JointLimits, LinkInertia, Model, Robot
from tauscope_drivers import ArmState, Backend, ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_sim.device import Injection
from tauscope_sim.device.drives import COMMANDED
from tauscope_sim.driver import RemoteSimulatedArm, SimulatedArm, start_device

Array = NDArray[np.float64]

START = np.array([0.2, -1.0, 0.4])
"""A place at which gravity would move joints 2 and 3."""

PATIENCE_S = 20.0

RATE_HZ = 250.0
"""Cycles a second, unless a test asks for others."""

AT_REST = 5e-3
"""Speed below which a joint counts as resting: what is left is the integral's creep against friction [rad/s]."""

SETTLED = 5e-4
"""How far a joint moves within 0.4 s that has settled: what is left is the integral's hunting about stiction [rad]."""


@dataclass(frozen=True, eq=False)
class Watched:
    """What the onlooker saw, a row an instant.

    time_ns : (N,) int64
        by the backend's clock
    position, velocity : (N, n) float64
        of the links
    commanded : (N,) bool
        whether the drives follow the host
    """

    time_ns: NDArray[np.int64]
    position: Array
    velocity: Array
    commanded: NDArray[np.bool_]


class Rig(Protocol):
    """One backend, and what the tests need beside it.

    `position_resolution` [rad] and `torque_resolution` [Nm] are the smallest steps that the drives know; 0 where there
    is none. `swing` is how far position loops that the backend does not tune carry a joint past a place, or leave it
    short of it [rad]. `answers_within` is the number of cycles in which every drive answers at least once: 1, unless
    frames are lost on purpose. `is_real_time` says whether its clock is the machine's, `tells_temperature` whether its
    drives measure theirs, `has_watchdog` whether they notice by themselves that their host is silent.
    """

    robot: Robot
    position_resolution: float
    torque_resolution: float
    swing: float
    answers_within: int
    is_real_time: bool
    tells_temperature: bool
    has_watchdog: bool

    @property
    def backend(self) -> Backend:
        """The backend under test."""
        ...

    def watch(self, duration_s: float) -> Watched:
        """Let time pass without a word from the host."""
        ...

    def look(self) -> Array:
        """Where the arm is now."""
        ...

    def inject(self, injection: Injection) -> None:
        """Disturb a joint."""
        ...

    def torque(self, effort: Array) -> Array:
        """Joint torque of an effort as the backend reports it [Nm]."""
        ...

    def another_host(self) -> Backend | None:
        """A second connection to the same drives; None where the backend is one with its drives."""
        ...


def bench_robot() -> Robot:
    """The paper's arm with its friction and limits."""
    robot = paper_arm()
    limits = JointLimits(position=(-2.9, 2.9), velocity=2.0, acceleration=5.0, torque=40.0)
    shape = FrictionShape(k_v=500.0, delta=10.0)
    friction = (
        FrictionCoefficients(2.0, -0.3, 0.5),
        FrictionCoefficients(1.0, -0.2, 0.277),
        FrictionCoefficients(2.0, -0.3, 0.03),
    )
    return replace(
        robot,
        joints=tuple(replace(joint, limits=limits, friction_shape=shape) for joint in robot.joints),
        model=Model(tuple(LinkInertia.from_vector(v) for v in paper_parameters().reshape(3, 10)), friction),
    )


class ExactRig:
    """What holds of drives that measure in SI units without steps."""

    position_resolution = 0.0
    torque_resolution = 0.0
    swing = 0.0
    answers_within = 1
    tells_temperature = True
    has_watchdog = True

    def torque(self, effort: Array) -> Array:
        return effort


class VirtualRig(ExactRig):
    """`SimulatedArm`: the onlooker is the device itself."""

    is_real_time = False

    def __init__(self, arm: SimulatedArm | None = None) -> None:
        self.robot = bench_robot()
        self.backend = self._arm = SimulatedArm(self.robot, start_position=START) if arm is None else arm

    def watch(self, duration_s: float) -> Watched:
        rows = []
        clock, device = self.backend.clock, self._arm.device
        end = clock.now_ns() + round(duration_s * 1e9)
        while clock.now_ns() < end:
            clock.wait_until_ns(min(end, clock.now_ns() + 1_000_000))
            rows.append((device.time_ns, *device.true_motion, device.activity in COMMANDED))
        times, positions, velocities, commanded = zip(*rows, strict=True)
        return Watched(np.array(times), np.array(positions), np.array(velocities), np.array(commanded))

    def look(self) -> Array:
        return self._arm.device.true_motion[0]

    def inject(self, injection: Injection) -> None:
        self._arm.device.inject(injection)
        self.watch(0.001)

    def another_host(self) -> Backend | None:
        return None


class RemoteRig(ExactRig):
    """`RemoteSimulatedArm`: the onlooker reads the trace of the device process."""

    is_real_time = True

    def __init__(self, socket: Path, trace: Path) -> None:
        self.robot = bench_robot()
        self._socket, self._trace = socket, trace
        self.backend = self._arm = RemoteSimulatedArm(socket, self.robot.joint_count, reply_timeout_s=1.0)

    def watch(self, duration_s: float) -> Watched:
        clock = self.backend.clock
        begin = clock.now_ns()
        end = begin + round(duration_s * 1e9)
        clock.wait_until_ns(end)
        trace = self._trace_until(end)
        rows = (trace.time_ns >= begin) & (trace.time_ns <= end)
        commanded = np.array([activity in COMMANDED for activity in trace.activity])
        return Watched(trace.time_ns[rows], trace.position[rows], trace.velocity[rows], commanded[rows])

    def look(self) -> Array:
        return self._trace_until(self.backend.clock.now_ns()).position[-1]

    def inject(self, injection: Injection) -> None:
        self._arm.inject(injection)
        self.watch(0.01)

    def another_host(self) -> Backend | None:
        return RemoteSimulatedArm(self._socket, self.robot.joint_count)

    def _trace_until(self, instant_ns: int):
        deadline = time.monotonic() + PATIENCE_S
        while (trace := read_trace(self._trace)).time_ns[-1] < instant_ns:
            assert time.monotonic() < deadline, "the device's trace does not go on"
            self.backend.clock.wait_until_ns(self.backend.clock.now_ns() + 2_000_000)
        return trace


@contextmanager
def virtual_rigs(_: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs in virtual time."""
    yield VirtualRig


@contextmanager
def remote_rigs(folder: Path) -> Iterator[Callable[[], Rig]]:
    """Rigs that share one device process; the arm is carried back before each of them."""
    with start_device(bench_robot(), folder, start_position=START.tolist()) as device:

        def rig() -> Rig:
            arm = RemoteSimulatedArm(device.socket, len(START), reply_timeout_s=1.0)
            arm.connect()
            arm.stop(StopPolicy.TORQUE_OFF)
            arm.put_back()
            arm.disconnect()
            return RemoteRig(device.socket, device.trace)

        yield rig


def wide_limits(robot: Robot, **changes: ArrayLike) -> DriveLimits:
    """The robot file's own limits, changed as a test needs."""
    n = robot.joint_count
    limits = DriveLimits(np.full(n, -2.9), np.full(n, 2.9), np.full(n, 3.0), np.full(n, 40.0))
    return replace(limits, **{name: np.broadcast_to(np.asarray(x, float), (n,)).copy() for name, x in changes.items()})


def enable(
    rig: Rig,
    mode: ControlMode = ControlMode.POSITION,
    *,
    policy: StopPolicy = StopPolicy.HOLD,
    watchdog_s: float = 0.5,
    **limits: ArrayLike,
) -> ArmState:
    """Connect and take the arm under power; skips the test where the drives cannot do the mode."""
    require_mode(rig, mode)
    rig.backend.connect()
    bounds = wide_limits(rig.robot, **limits)
    return rig.backend.enable(mode, bounds, allowed(rig, mode, policy), watchdog_s, 1.0 / RATE_HZ)


def allowed(rig: Rig, mode: ControlMode, policy: StopPolicy) -> StopPolicy:
    """A stop policy, or one that the drives can carry out by themselves where they cannot do that in this mode."""
    able = rig.backend.capabilities.policies_in(mode)
    return policy if policy in able else min(able)


def require_mode(rig: Rig, mode: ControlMode) -> None:
    """Skip the test where the drives cannot do a mode."""
    if mode not in rig.backend.capabilities.modes:
        pytest.skip(f"the drives have no mode {mode}")


def require_policy(rig: Rig, policy: StopPolicy, mode: ControlMode = ControlMode.POSITION) -> None:
    """Skip the test where the drives cannot carry out a policy by themselves."""
    if policy not in rig.backend.capabilities.policies_in(mode):
        pytest.skip(f"the drives cannot {policy} by themselves in mode {mode}")


def setpoint(position: Array, torque: Array | None = None) -> Setpoint:
    """A setpoint without feed-forward, unless stated."""
    return Setpoint(position, np.zeros_like(position) if torque is None else torque)


def drive(
    rig: Rig, command: Callable[[float], Setpoint], duration_s: float, *, rate_hz: float = RATE_HZ
) -> list[ArmState]:
    """Cycle for some time: the command is a function of the time since the start [s]."""
    clock = rig.backend.clock
    begin = clock.now_ns()
    states = []
    for cycle in range(round(duration_s * rate_hz)):
        clock.wait_until_ns(begin + round(cycle * 1e9 / rate_hz))
        states.append(rig.backend.exchange(command((clock.now_ns() - begin) * 1e-9)))
    return states


def ask(
    rig: Rig, command: Setpoint, is_answered: Callable[[ArmState], bool] = lambda state: bool(state.fresh.all())
) -> ArmState:
    """One cycle; on a bus that loses frames as many as that may take, until all drives have answered it."""
    state = rig.backend.exchange(command)
    for _ in range(rig.answers_within - 1):
        if is_answered(state):
            break
        state = rig.backend.exchange(command)
    return state


def settled(rig: Rig) -> Array:
    """Where a stopped arm stays: it is not only slow, the integrals of its loops have come to rest."""
    for _ in range(round(PATIENCE_S / 0.4)):
        seen = rig.watch(0.4).position
        if np.ptp(seen, axis=0).max() < SETTLED:
            return seen[-1]
    pytest.fail(f"the arm does not come to rest within {PATIENCE_S} s")


def slide(start: Array, speed: float) -> Callable[[float], Setpoint]:
    """All joints at constant speed, after a soft start of 0.1 s."""

    def command(t: float) -> Setpoint:
        distance = speed * (t - 0.05 if t > 0.1 else 5.0 * t * t)
        return setpoint(start + distance)

    return command
