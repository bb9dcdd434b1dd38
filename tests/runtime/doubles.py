"""Small stand-ins for arms: point masses that do as they are told, and note what they were told."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from arms import dh_segment
from tauscope.robot import Joint, JointLimits, LinkInertia, Robot
from tauscope.runtime.drivers import Connection
from tauscope.trajectory import FourierSegment, FourierSeries, Trajectory
from tauscope_drivers import ArmState, Capabilities, ControlMode, DriveLimits, DriverError, Fault, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind

Array = NDArray[np.float64]


class VirtualClock:
    """Waits by moving on; `delays` makes it late."""

    def __init__(self) -> None:
        self.time_ns = 1_000_000_000
        self.delay: Callable[[int], int] = lambda deadline_ns: 0

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until_ns(self, deadline_ns: int) -> int:
        self.time_ns = max(self.time_ns, deadline_ns) + self.delay(deadline_ns)
        return self.time_ns


@dataclass
class PointArm:
    """Links that turn about one vertical axis; in position mode each joint is where it was sent."""

    joint_count: int = 2
    position: Array = field(default_factory=lambda: np.zeros(2))
    clock: VirtualClock = field(default_factory=VirtualClock)
    effort_unit: str = "Nm"
    velocity_is_reported: bool = True
    calls: list[str] = field(default_factory=list)
    sent: list[Setpoint] = field(default_factory=list)
    stops: list[StopPolicy] = field(default_factory=list)
    limits: DriveLimits | None = None
    enabled: bool = False
    tamper: Callable[["PointArm", ArmState], ArmState] | None = None
    fail: dict[str, Callable[[], None]] = field(default_factory=dict)
    modes: frozenset[ControlMode] = frozenset(ControlMode)
    largest_rate_hz: float = 2000.0

    def __post_init__(self) -> None:
        self.position = np.array(self.position, dtype=float)
        self.velocity = np.zeros(self.joint_count)
        # The links of `point_robot`: link k turns with the sum of the joints up to k.
        share = np.tri(self.joint_count) / np.sqrt(self.joint_count)
        self.inertia = share.T @ share
        self.mode = ControlMode.POSITION

    @property
    def capabilities(self) -> Capabilities:
        policies = frozenset(StopPolicy)
        return Capabilities(
            self.joint_count, self.modes, policies, self.largest_rate_hz, (0.01, 1.0), True, self.effort_unit
        )

    def connect(self) -> ArmState:
        self._call("connect")
        return self._state(np.zeros(self.joint_count))

    def acknowledge_faults(self) -> ArmState:
        self._call("acknowledge_faults")
        return self._state(np.zeros(self.joint_count))

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        del cycle_s
        self._call("enable")
        self.mode, self.limits, self.enabled = mode, limits, True
        self.then = self.clock.now_ns()
        return self._state(np.zeros(self.joint_count))

    def exchange(self, setpoint: Setpoint) -> ArmState:
        self._call("exchange")
        if not self.enabled:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "not enabled")
        self.sent.append(Setpoint(setpoint.position.copy(), setpoint.torque.copy()))
        now = self.clock.now_ns()
        elapsed, self.then = (now - self.then) * 1e-9, now
        if self.mode is ControlMode.TORQUE:
            acceleration = np.linalg.solve(self.inertia, setpoint.torque)
            self.position = self.position + elapsed * self.velocity + 0.5 * elapsed**2 * acceleration
            self.velocity = self.velocity + elapsed * acceleration
        else:
            self.velocity = (setpoint.position - self.position) / elapsed if elapsed > 0 else self.velocity
            self.position = setpoint.position.copy()
        return self._state(setpoint.torque)

    def stop(self, policy: StopPolicy) -> ArmState:
        self._call("stop")
        self.stops.append(policy)
        self.enabled = False
        return self._state(np.zeros(self.joint_count))

    def disconnect(self) -> None:
        self._call("disconnect")

    def _call(self, name: str) -> None:
        if not self.calls or self.calls[-1] != name:
            self.calls.append(name)
        if name in self.fail:
            self.fail[name]()

    def _state(self, effort: Array) -> ArmState:
        n = self.joint_count
        velocity = self.velocity.copy() if self.velocity_is_reported else np.full(n, np.nan)
        state = ArmState(
            self.clock.now_ns(),
            self.position.copy(),
            velocity,
            effort.copy(),
            np.full(n, 30.0),
            np.full(n, self.enabled),
        )
        return state if self.tamper is None else self.tamper(self, state)


def connection(arm: PointArm) -> Callable[[], Connection]:
    return lambda: Connection(arm, is_real_time=False)


def point_robot(joint_count: int = 2, torque: float | None = 50.0, **limits: object) -> Robot:
    """An arm whose joints' axes are vertical, so that gravity does not matter, with light round links."""
    bounds = {"position": (-2.0, 2.0), "velocity": 2.0, "acceleration": 10.0, "torque": torque} | limits
    joints = tuple(Joint(f"joint{j + 1}", limits=JointLimits(**bounds)) for j in range(joint_count))  # type: ignore[arg-type]
    robot = Robot("points", joints, tuple(dh_segment(0.0, 0.1, 0.0, 0.0) for _ in range(joint_count)))
    link = LinkInertia(0.0, np.zeros(3), np.diag([0.0, 0.0, 1.0 / joint_count]))
    return replace(robot, model=replace(robot.model, links=(link,) * joint_count))


def short_motion(robot: Robot, *, period_s: float = 0.5, repeats: int = 4, amplitude: float = 0.07) -> Trajectory:
    """Two harmonics, at rest with zero acceleration at the ends of each period."""
    n = robot.joint_count
    speed = amplitude * 2 * np.pi / period_s
    cosine = np.tile([speed, -speed], (n, 1)) * np.linspace(0.5, 1.0, n)[:, None]
    series = FourierSeries(period_s, np.linspace(0.1, 0.3, n), cosine, np.zeros((n, 2)))
    names = tuple(joint.name for joint in robot.joints)
    return Trajectory(robot.name, names, (FourierSegment(series, repeats, 0),))


def with_fault(state: ArmState, code: str = "overload", joint: int | None = 2) -> ArmState:
    return replace(state, faults=(Fault(code, joint, "the drive is overloaded", "take the load off"),))
