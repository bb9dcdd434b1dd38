"""The guard between the loop and the backend: nothing is sent to the arm that it has not passed."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tauscope.errors import AcquisitionError
from tauscope.robot import JointType, Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.limits import motion_limits
from tauscope.trajectory.servo_bounds import DEFAULT_FOLLOWING
from tauscope_drivers import ArmState, DriveLimits, Setpoint


class Rule(StrEnum):
    NOT_FINITE = "not-finite"  # every target is a number
    POSITION = "position"  # targets lie within the position limits, and the arm no further outside than the margin
    VELOCITY = "velocity"  # targets and arm move no faster than the velocity limit
    TORQUE = "torque"  # no more torque is commanded than the torque limit
    FOLLOWING = "following-error"  # the arm is where it was sent
    BRAKING = "braking-distance"  # the arm can come to rest before its position limit
    TEMPERATURE = "temperature"  # no motor is too hot
    STALE = "stale-state"  # every joint has answered lately
    TIME = "time"  # time runs forward
    LATE = "late"  # the loop is no later than the device's watchdog allows
    FAULT = "fault"  # no drive reports a fault
    NOT_ENABLED = "not-enabled"  # every drive is under power


@dataclass(frozen=True)
class Violation:
    """`joint`: None where it concerns the whole arm; `value`: in the rule's unit, None where it is no number."""

    rule: Rule
    joint: str | None
    value: float | None
    limit: float | None
    detail: str

    def __str__(self) -> str:
        return f"{self.detail} ({self.rule})"


class GuardViolationError(AcquisitionError):
    """The guard let a command not pass: nothing was sent, and the arm is to be stopped."""

    def __init__(self, violation: Violation) -> None:
        super().__init__(str(violation))
        self.violation = violation


DEFAULT_MARGIN = {JointType.REVOLUTE: 0.05, JointType.PRISMATIC: 0.01}
"""How far outside the position limits the arm itself, not a command, may be found [rad or m]."""
SPEED_MARGIN = 1.5  # measured speed may be this many times the limit: velocity is noisy where encoders give it
_ROOM = 1.05


@dataclass(frozen=True, eq=False)
class GuardLimits:
    """Limits of every joint; infinite where there is none. `position_low`, `position_high`: (n,) [rad or m]."""

    joints: tuple[str, ...]
    units: tuple[str, ...]
    position_low: Array
    position_high: Array
    velocity: Array  # (n,), largest speed of the targets [rad/s or m/s]
    acceleration: Array  # (n,), deceleration on which braking can count [rad/s² or m/s²]
    torque: Array  # (n,), largest commanded torque [Nm or N]
    following: Array  # (n,), largest distance between target and arm [rad or m]
    position_margin: Array  # (n,), how far outside the range the arm itself may be found [rad or m]
    temperature_c: float = 80.0  # hottest motor [°C]

    @property
    def drive_limits(self) -> DriveLimits:
        return DriveLimits(
            position_low=self.position_low - self.position_margin,
            position_high=self.position_high + self.position_margin,
            velocity=SPEED_MARGIN * self.velocity,
            torque=self.torque.copy(),
        )


def guard_limits(
    robot: Robot, low: Array, high: Array, speed: Array, *, following: float | None = None, temperature_c: float = 80.0
) -> GuardLimits:
    """The limits of a run: the robot file's where it states them, else a careful default or what the motion needs.

    `low`, `high`, `speed`: (n,), of the motion [rad or m, and per s]; `following`: of every joint; `temperature_c`:
    [°C].
    """
    limits, joints = motion_limits(robot), robot.joints
    has_range = np.array([joint.limits.position is not None for joint in joints])
    has_speed = np.array([joint.limits.velocity is not None for joint in joints])
    has_acceleration = np.array([joint.limits.acceleration is not None for joint in joints])
    room = np.array([DEFAULT_MARGIN[joint.type] for joint in joints])
    return GuardLimits(
        joints=tuple(joint.name for joint in joints),
        units=tuple(joint.type.unit for joint in joints),
        position_low=np.where(has_range, limits.position_low, np.minimum(limits.position_low, low - room)),
        position_high=np.where(has_range, limits.position_high, np.maximum(limits.position_high, high + room)),
        velocity=np.where(has_speed, limits.velocity, np.maximum(limits.velocity, _ROOM * speed)),
        acceleration=np.where(has_acceleration, limits.acceleration, np.inf),
        torque=limits.torque,
        following=np.array([DEFAULT_FOLLOWING[joint.type] if following is None else following for joint in joints]),
        position_margin=room,
        temperature_c=temperature_c,
    )


PERSISTENCE = 3  # cycles in a row after which a measured speed counts: one noisy reading is no runaway
_ROUNDING = 1e-9
_NANOSECOND = 1e-9
_COMMAND_RULES = (Rule.POSITION, Rule.POSITION, Rule.VELOCITY, Rule.TORQUE)
_STATE_RULES = (Rule.POSITION, Rule.POSITION, Rule.FOLLOWING, Rule.TEMPERATURE)
_SPEED_RULES = (Rule.VELOCITY, Rule.BRAKING, Rule.BRAKING)


class Guard:
    """Holds commands and states against the limits; reads no clock and no device: the same calls, the same verdicts."""

    def __init__(
        self,
        limits: GuardLimits,
        *,
        period_s: float,
        watchdog_s: float,
        enabled_ns: int,
        stale_misses: int = 3,
        stale_s: float = 0.05,
    ) -> None:
        """`period_s`: between commands; `watchdog_s`: the device's; `enabled_ns`: when; `stale_s`: at most so long."""
        self.stale = np.zeros(len(limits.joints), dtype=np.int64)
        self._limits = limits
        self._period_s, self._watchdog_s = period_s, watchdog_s
        self._stale_misses, self._stale_s = stale_misses, stale_s
        self._now = self._due = enabled_ns
        self._state_ns: int | None = None
        self._previous: Array | None = None
        n = len(limits.joints)
        self._misses = np.zeros(n, dtype=np.int64)
        self._answered = np.full(n, enabled_ns, dtype=np.int64)
        self._fast = np.zeros((len(_SPEED_RULES), n), dtype=np.int64)
        self._violation: Violation | None = None

    def check(self, state: ArmState, setpoint: Setpoint, now_ns: int, due_ns: int) -> Violation | None:
        """Judge a command before it is sent. `now_ns`: now; `due_ns`: when it was due, by which speeds are judged."""
        if self._violation is None:
            with np.errstate(all="ignore"):  # absurd commands overflow, and are refused
                self._violation = (
                    self._check_time(state, now_ns, due_ns)
                    or self._check_drives(state)
                    or self._check_answers(state)
                    or self._check_command(state, setpoint, due_ns)
                    or self._check_state(state, setpoint)
                )
        if self._violation is None:
            self._now, self._due, self._previous = now_ns, due_ns, setpoint.position
            if state.fresh.any():
                self._state_ns = state.time_ns
        return self._violation

    def _check_time(self, state: ArmState, now_ns: int, due_ns: int) -> Violation | None:
        since, overdue = (now_ns - self._now) * _NANOSECOND, (now_ns - due_ns) * _NANOSECOND
        if since < 0 or due_ns < self._due or (self._previous is not None and due_ns == self._due) or overdue < 0:
            return _whole_arm(Rule.TIME, since, 0.0, "time stood still or ran backwards; check the backend's clock")
        # A cycle without any answer has the host's time, which may be ahead of the device's.
        if self._state_ns is not None and state.time_ns < self._state_ns and state.fresh.any():
            age = (state.time_ns - self._state_ns) * _NANOSECOND
            return _whole_arm(Rule.TIME, age, 0.0, "the arm's reading is older than the one before; check its clock")
        late = max(since, overdue)
        if late > self._watchdog_s:
            advice = "use a quieter machine, a lower rate or a longer watchdog"
            detail = (
                f"the control loop is {late:.3g} s late, the device's watchdog allows {self._watchdog_s:g} s; {advice}"
            )
            return _whole_arm(Rule.LATE, late, self._watchdog_s, detail)
        return None

    def _check_drives(self, state: ArmState) -> Violation | None:
        if state.faults:
            fault = state.faults[0]
            joint = None if fault.joint is None else self._limits.joints[fault.joint - 1]
            more = f" (the first of {len(state.faults)} faults)" if len(state.faults) > 1 else ""
            return Violation(Rule.FAULT, joint, None, None, f"{fault}{more}")
        if not state.enabled.all():
            joint = self._limits.joints[int(np.argmin(state.enabled))]
            return Violation(
                Rule.NOT_ENABLED, joint, None, None, f"{joint}: its drive is no longer enabled; look at the drive"
            )
        return None

    def _check_answers(self, state: ArmState) -> Violation | None:
        """A reading of the same instant as the one before is none."""
        fresh = state.fresh & (state.time_ns != self._state_ns)
        if fresh.all():
            self._misses[:] = 0
            self._answered[:] = state.time_ns
            return None
        self._answered[fresh] = state.time_ns
        self._misses = np.where(fresh, 0, self._misses + 1)
        self.stale += ~fresh
        age = (state.time_ns - self._answered) * _NANOSECOND
        # Where the arm stands has to be known before the first command.
        most = self._stale_misses if self._previous is not None else 1
        lost = (self._misses >= most) | (age > self._stale_s)
        if not lost.any():
            return None
        j = int(np.argmax(lost))
        name, misses = self._limits.joints[j], int(self._misses[j])
        detail = f"{name}: no reading in {misses} cycles, for {age[j]:.3g} s; check its cable and its drive"
        return Violation(Rule.STALE, name, float(misses), float(most), detail)

    def _check_command(self, state: ArmState, setpoint: Setpoint, due_ns: int) -> Violation | None:
        """Every comparison is written so that NaN fails it; the first command starts from where the arm stands."""
        limits, target = self._limits, setpoint.position
        elapsed = max((due_ns - self._due) * _NANOSECOND, self._period_s)
        allowed = limits.velocity * elapsed
        if self._previous is None:
            step, allowed = np.abs(target - state.position), allowed + limits.position_margin
        else:
            step = np.abs(target - self._previous)
        excess = np.stack(
            [
                limits.position_low - target,
                target - limits.position_high,
                step - allowed,
                np.abs(setpoint.torque) - limits.torque,
            ]
        )
        if (excess <= _ROUNDING).all():
            return None
        finite = np.isfinite(target) & np.isfinite(setpoint.torque)
        if not finite.all():
            j = int(np.argmin(finite))
            name = limits.joints[j]
            detail = f"{name}: the command is not a number; this is a fault of the controller, report it"
            return Violation(Rule.NOT_FINITE, name, None, None, detail)
        row, j = (int(index) for index in np.argwhere(~(excess <= _ROUNDING))[0])
        found = (target, target, step / elapsed, np.abs(setpoint.torque))[row][j]
        bound = (limits.position_low, limits.position_high, limits.velocity, limits.torque)[row][j]
        return self._objection(_COMMAND_RULES[row], j, float(found), float(bound), "the command")

    def _check_state(self, state: ArmState, setpoint: Setpoint) -> Violation | None:
        """NaN is a sample that was missed, and passes: `_check_answers` counts those."""
        limits, position = self._limits, state.position
        error = np.abs(setpoint.position - position)
        low, high = limits.position_low - limits.position_margin, limits.position_high + limits.position_margin
        excess = np.stack(
            [low - position, position - high, error - limits.following, state.temperature - limits.temperature_c]
        )
        if (excess > 0.0).any():
            row, j = (int(index) for index in np.argwhere(excess > 0.0)[0])
            found = (position, position, error, state.temperature)[row][j]
            hottest = np.full_like(low, limits.temperature_c)
            bound = (low, high, limits.following, hottest)[row][j]
            return self._objection(_STATE_RULES[row], j, float(found), float(bound), "the arm")
        return self._check_speed(state.position, state.velocity)

    def _check_speed(self, position: Array, velocity: Array) -> Violation | None:
        limits = self._limits
        way = velocity * np.abs(velocity) / (2.0 * limits.acceleration)
        speed_limit, rest = SPEED_MARGIN * limits.velocity, position + way
        low, high = limits.position_low - limits.position_margin, limits.position_high + limits.position_margin
        excess = np.stack([np.abs(velocity) - speed_limit, low - rest, rest - high])
        over = excess > 0.0
        if not over.any():
            self._fast[:] = 0
            return None
        self._fast = np.where(over, self._fast + 1, 0)
        if (self._fast < PERSISTENCE).all():
            return None
        row, j = (int(index) for index in np.argwhere(self._fast >= PERSISTENCE)[0])
        found, bound = (np.abs(velocity), rest, rest)[row][j], (speed_limit, low, high)[row][j]
        return self._objection(_SPEED_RULES[row], j, float(found), float(bound), "the arm")

    def _objection(self, rule: Rule, joint: int, value: float, limit: float, who: str) -> Violation:
        name, unit = self._limits.joints[joint], self._limits.units[joint]
        force = "Nm" if unit == "rad" else "N"
        what, advice = {
            Rule.POSITION: (f"{who} is at {value:.4g} {unit}", "keep the motion within the robot file's limits"),
            Rule.VELOCITY: (f"{who} moves at {value:.4g} {unit}/s", "slow the motion down"),
            Rule.TORQUE: (f"{who} is {value:.4g} {force}", "slow the motion down or check the model"),
            Rule.FOLLOWING: (
                f"{who} is {value:.4g} {unit} away from where it was sent",
                "look for an obstacle, a torque limit or a loose drive",
            ),
            Rule.BRAKING: (f"{who} would come to rest only at {value:.4g} {unit}", "keep away from the limit"),
            Rule.TEMPERATURE: (f"its motor has {value:.4g} °C", "let it cool down"),
        }[rule]
        bound = {Rule.TORQUE: force, Rule.VELOCITY: f"{unit}/s", Rule.TEMPERATURE: "°C"}.get(rule, unit)
        return Violation(rule, name, value, limit, f"{name}: {what}, the limit is {limit:.4g} {bound}; {advice}")


def _whole_arm(rule: Rule, value: float, limit: float, detail: str) -> Violation:
    return Violation(rule, None, value, limit, detail)
