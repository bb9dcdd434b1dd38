"""The plan of a run, made before the arm is under power: targets and model torque of every cycle, and limits."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics import friction_torque, inverse_dynamics, mass_matrix
from tauscope.errors import AcquisitionError
from tauscope.recording.journal_rows import Phase
from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope.runtime.guard import GuardLimits, guard_limits
from tauscope.runtime.options import RunOptions, choose_rate_hz
from tauscope.trajectory.limits import motion_limits
from tauscope.trajectory.segments import MoveSegment
from tauscope.trajectory.servo_bounds import BOUNDS, TorqueBounds, servo_bounds
from tauscope.trajectory.trajectory import Trajectory, ramp
from tauscope_drivers import Capabilities, ControlMode

_MOST_POSTURES = 100_000


def predict_torque(robot: Robot, position: Array, velocity: Array, acceleration: Array) -> Array | None:
    """τ = H(q) q̈ + h(q, q̇) + c(q) + τ_f(q̇), (N, n) [Nm or N], without unstated friction; None without a model.

    `position`, `velocity`, `acceleration`: (N, n), the motion [rad or m, and per s, per s²].
    """
    parameters = _parameters(robot)
    if parameters is None:
        return None
    torque = inverse_dynamics(robot, parameters, position, velocity, acceleration)
    for j, coefficients in enumerate(robot.model.friction or ()):
        shape = robot.joints[j].friction_shape
        if shape.k_v is not None and shape.delta is not None:
            torque[:, j] += friction_torque(coefficients, shape, np.ascontiguousarray(velocity[:, j]))
    return torque


def compute_inertia(robot: Robot, position: Array) -> tuple[Array, int] | None:
    """H, (K, n, n), at every s-th `position`, (N, n), of a motion, and s; None without a model [kg m², kg m, kg]."""
    parameters = _parameters(robot)
    if parameters is None:
        return None
    stride = -(-len(position) // _MOST_POSTURES)
    return mass_matrix(robot, parameters, position[::stride]), stride


def _parameters(robot: Robot) -> Array | None:
    if robot.model.links is None:
        return None
    return np.concatenate([link.to_vector() for link in robot.model.links])


MOST_CYCLES = 4_000_000  # A longer run must be a mistake: it is more than two hours at 500 cycles a second
_ROUNDING = 1e-9
_LEAST_PACE = 0.1  # part of the speed limits below which no ramp is slowed down for weak servos: they are refused


@dataclass(frozen=True, eq=False)
class Plan:
    """Targets of every cycle, the ramp's first: (N, n) [rad or m, and per s]. `period_ns`: of a cycle [ns]."""

    rate_hz: float  # cycles a second [Hz]
    period_ns: int
    position: Array
    velocity: Array
    torque: Array  # (N, n), what the model predicts, within the torque limits; zero where there is no model [Nm or N]
    period: Array  # (N,), index of the excitation period, NaN outside the repeated part
    phase: NDArray[np.int64]  # (N,) int64, ramp or motion, as in `tauscope.recording.journal_rows.Phase`
    limits: GuardLimits

    @property
    def cycles(self) -> int:
        return len(self.position)

    @property
    def ramp_cycles(self) -> int:
        return int(np.count_nonzero(self.phase == Phase.RAMP))

    @property
    def ramp_s(self) -> float:
        """Time until the motion begins [s]."""
        return self.ramp_cycles / self.rate_hz

    @property
    def motion_s(self) -> float:
        """How long the motion lasts [s]."""
        return (self.cycles - self.ramp_cycles) / self.rate_hz


def make_plan(
    robot: Robot,
    trajectory: Trajectory,
    start: Array,
    options: RunOptions,
    capabilities: Capabilities,
    voltage: Array | None = None,
) -> Plan:
    """A minimum-jerk ramp from `start`, (n,), a pause, the motion. Raises AcquisitionError where they do not fit.

    `voltage`: (n,), supply of the servos as measured [V].
    """
    _require_fitting(robot, trajectory, start, capabilities)
    rate_hz = choose_rate_hz(options, capabilities)
    if trajectory.duration_s * rate_hz > MOST_CYCLES:
        raise AcquisitionError(
            f"the motion lasts {trajectory.duration_s:.4g} s; at {rate_hz:g} cycles a second at most "
            f"{MOST_CYCLES / rate_hz:.4g} s can be run"
        )
    motion = trajectory.samples(rate_hz)
    speed = np.abs(np.diff(motion.position, axis=0)).max(axis=0, initial=0.0) * rate_hz
    low, high = motion.position.min(axis=0), motion.position.max(axis=0)
    following, hottest = options.following_error, options.temperature_c
    limits = guard_limits(robot, low, high, speed, following=following, temperature_c=hottest)
    _require_within(limits, robot, start, low, high, speed)
    begin = np.clip(start, limits.position_low, limits.position_high)
    bounds, usual = servo_bounds(robot, limits.following, rate_hz, voltage), motion_limits(robot)
    gentle = np.clip(bounds.speed, _LEAST_PACE * usual.velocity, usual.velocity)
    way = ramp(begin, trajectory.start, replace(usual, velocity=gentle))
    way = MoveSegment(way.start, way.end, float(np.ceil(way.duration_s * rate_hz)) / rate_hz)
    ramp_cycles = round(way.duration_s * rate_hz)
    moved = way.evaluate(np.arange(ramp_cycles) / rate_hz)
    pause = round(options.settle_s * rate_hz)
    rest = np.zeros((pause, robot.joint_count))
    position = np.concatenate([moved.position, np.broadcast_to(way.end, rest.shape), motion.position])
    velocity = np.concatenate([moved.velocity, rest, motion.velocity])
    acceleration = np.concatenate([moved.acceleration, rest, motion.acceleration])
    before = ramp_cycles + pause
    gives_torque = options.mode is ControlMode.TORQUE or (options.feed_forward and capabilities.takes_feed_forward)
    known = predict_torque(robot, position, velocity, acceleration) if gives_torque or bounds.names else None
    torque = np.zeros_like(position) if known is None else known
    _require_followed(robot, bounds, torque, velocity, rate_hz, droops=not gives_torque)
    # A model may be wrong, the arm must not pay for it.
    given = np.clip(torque, -limits.torque, limits.torque) if gives_torque else np.zeros_like(torque)
    return Plan(
        rate_hz=rate_hz,
        period_ns=round(1e9 / rate_hz),
        position=position,
        velocity=velocity,
        torque=given,
        period=np.concatenate([np.full(before, np.nan), motion.period]),
        phase=np.repeat([Phase.RAMP, Phase.MOTION], [before, len(motion.time)]).astype(np.int64),
        limits=limits,
    )


def _require_fitting(robot: Robot, trajectory: Trajectory, start: Array, capabilities: Capabilities) -> None:
    """Refuse a motion or an arm of another number of joints, and an arm that does not say where it stands."""
    n = robot.joint_count
    counts = {"the trajectory moves": trajectory.joint_count, "the backend has": capabilities.joint_count}
    for what, count in counts.items():
        if count != n:
            raise AcquisitionError(f"{robot.name} has {n} joints, {what} {count}; give what belongs to this arm")
    silent = [joint.name for joint, position in zip(robot.joints, start, strict=True) if not np.isfinite(position)]
    if silent:
        raise AcquisitionError(f"{silent[0]}: does not say where it stands; check its cable and its drive")


def _require_within(limits: GuardLimits, robot: Robot, start: Array, low: Array, high: Array, speed: Array) -> None:
    """Refuse before it moves what the guard would stop while it moves."""
    for j, joint in enumerate(robot.joints):
        bounds, unit = (limits.position_low[j], limits.position_high[j]), limits.units[j]
        words = f"{joint.name}: its limits are {bounds[0]:.4g} to {bounds[1]:.4g} {unit}"
        outside = max(bounds[0] - start[j], start[j] - bounds[1])
        if outside > limits.position_margin[j]:
            raise AcquisitionError(f"{words}, and the arm stands at {start[j]:.4g} {unit}; move it inside by hand")
        reach = low[j] if low[j] < bounds[0] - _ROUNDING else high[j]
        if not bounds[0] - _ROUNDING <= reach <= bounds[1] + _ROUNDING:
            raise AcquisitionError(f"{words}, and the motion goes to {reach:.4g} {unit}; design it within the limits")
        if speed[j] > limits.velocity[j] * (1.0 + _ROUNDING):
            raise AcquisitionError(
                f"{joint.name}: the motion moves at {speed[j]:.4g} {unit}/s, its limit is {limits.velocity[j]:.4g} "
                f"{unit}/s; design it within the limits"
            )


def _require_followed(
    robot: Robot, bounds: TorqueBounds, torque: Array, velocity: Array, rate_hz: float, *, droops: bool
) -> None:
    """Refuse before it moves what a servo would lag behind until the guard stops it. NaN is refused.

    `droops`: whether a servo exerts torque by its following error alone, and is not given it.
    """
    speed = np.abs(velocity)
    for row, name in enumerate(bounds.names):
        available = bounds.available[row] - bounds.damping[row] * speed
        excess = np.abs(torque) - available
        if (excess <= 0.0).all() or not (droops or name == "voltage"):
            continue
        cycle, j = (int(index) for index in np.unravel_index(np.argmax(excess), excess.shape))
        joint = robot.joints[j]
        raise AcquisitionError(
            f"{joint.name}: {cycle / rate_hz:.3g} s after the start the motion needs {abs(torque[cycle, j]):.3g} "
            f"{joint.type.torque_unit} at {speed[cycle, j]:.3g} {joint.type.unit}/s; its {name} leaves "
            f"{max(available[cycle, j], 0.0):.3g} {joint.type.torque_unit} there; design it anew; {BOUNDS[name]}"
        )
