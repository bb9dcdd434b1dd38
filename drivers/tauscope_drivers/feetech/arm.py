"""An arm of STS3215 servos as a backend: the order of calls, and what a cycle is made of."""

import contextlib
from collections.abc import Iterator, Sequence

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.feetech.budget import adapter_latency_s, cycle_parts, largest_part, largest_rate_hz
from tauscope_drivers.feetech.bus import FeetechBus
from tauscope_drivers.feetech.commissioning import ServoTask
from tauscope_drivers.feetech.configuration import read_configuration
from tauscope_drivers.feetech.enabling import enable_servos, goal_writes, plan_tasks, stop_servos
from tauscope_drivers.feetech.faults import lost_bus_fault, silent_servo_fault
from tauscope_drivers.feetech.observation import arm_state, blind_state, observe
from tauscope_drivers.feetech.registers import FEEDBACK, VOLT
from tauscope_drivers.feetech.session import SHORTEST_RETURN_DELAY_S, Session, open_session
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.limits import require_finite
from tauscope_drivers.serial_port import SerialPort
from tauscope_drivers.state import ArmState, Setpoint

WATCHDOG_RANGE_S = (0.02, 2.5)
"""Silence of the host after which no goal is sent until the fault is acknowledged [s]."""

_NO_WATCHDOG = "the servos have no watchdog: without their host they hold their last goal"


class FeetechArm:
    """Implements `drivers.Backend` in position mode.

    These servos have no watchdog. One that hears nothing more goes on to its last goal, at most one cycle away, and
    holds it; the arm reports ``watchdog`` at the next call, and sends no goal until that is acknowledged. Effort is
    Present Load, the duty of the motor's bridge. Nothing is written to EEPROM.
    """

    def __init__(self, joints: Sequence[DriveJoint], *, slack_s: float = 0.002, clock: Clock | None = None) -> None:
        """Nothing is opened yet. Raises DriverError: ``refused``: a ``drive`` block is not valid."""
        self._configuration = read_configuration(joints)
        self._clock = MonotonicClock() if clock is None else clock
        self._port = SerialPort(self._configuration.port, self._configuration.baud, slack_s)
        self._session: Session | None = None
        self._tasks: list[ServoTask] | None = None
        self._policy = StopPolicy.HOLD
        self._watchdog_s = 0.0
        self._last_exchange_ns = 0
        self._pace: GoalPace | None = None
        self._lost: tuple[Fault, ...] = ()
        self._remarks: tuple[str, ...] = ()

    @property
    def capabilities(self) -> Capabilities:
        """What these servos can do; the rate is exact once they are reached."""
        parts = self._cycle_parts()
        return Capabilities(
            joint_count=len(self._configuration.servos),
            modes=frozenset([ControlMode.POSITION]),
            stop_policies=frozenset([StopPolicy.HOLD]),
            largest_rate_hz=largest_rate_hz(parts),
            watchdog_range_s=WATCHDOG_RANGE_S,
            takes_feed_forward=False,
            effort_unit="permille",
            rate_limited_by=largest_part(parts),
            remarks=self._remarks,
        )

    @property
    def clock(self) -> Clock:
        """The machine's monotonic clock, where no other was given."""
        return self._clock

    def connect(self) -> ArmState:
        """Lock the port and reach every servo; writes nothing.

        Raises DriverError ``cannot-connect``: connected already, the port is taken or missing, a servo is missing or of
        the wrong kind.
        """
        if self._session is not None:
            raise DriverError(DriverErrorKind.CANNOT_CONNECT, "the arm is connected already; disconnect it first")
        self._lost = ()
        self._port.open()
        try:
            self._session = open_session(FeetechBus(self._port, self._clock), self._configuration.servos)
            self._remarks = (_NO_WATCHDOG, *_describe_servos(self._session))
        except DriverError as error:
            self._session = None
            self._port.close()
            raise DriverError(DriverErrorKind.CANNOT_CONNECT, str(error), error.faults) from error
        return self._observe(self._session)

    def acknowledge_faults(self) -> ArmState:
        """Forget alarms whose cause is gone; an arm that is still enabled is stopped by its policy first.

        Raises DriverError: ``not-connected``, or ``fault`` where a fault stays.
        """
        session = self._require_session()
        with self._watching_the_port():
            if self._tasks is not None:
                self.stop(self._policy)
            session.health.forget()
            for joint in range(len(session.servos)):
                session.read_targets(joint)
        if faults := session.health.faults:
            raise DriverError(DriverErrorKind.FAULT, f"{faults[0]}", faults)
        return self._observe(session)

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power where it stands.

        Raises DriverError: ``not-connected``, ``refused`` or ``fault``.

        `watchdog_s`: longest silence of the host [s]; `cycle_s`: time between two goals, over which the servos go from
        one to the next; they leap where it is None [s].
        """
        session = self._require_session()
        self._require_possible(mode, stop_policy, watchdog_s)
        with self._watching_the_port():
            for joint in range(len(session.servos)):
                session.read_targets(joint)
            if faults := session.health.faults:
                raise DriverError(DriverErrorKind.FAULT, f"{faults[0]}", faults)
            tasks = plan_tasks(session, limits)
            held = enable_servos(session, tasks)
        caps = [task.speed for task in tasks]
        self._pace = None
        if cycle_s is not None:
            self._pace = GoalPace(session.servos, held, caps, cycle_s, self._clock.now_ns())
        self._tasks, self._policy, self._watchdog_s = tasks, stop_policy, watchdog_s
        self._last_exchange_ns = self._clock.now_ns()
        return self._observe(session)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """One cycle: Sync Write of the goals, Sync Read of all servos, torque and limits of one servo.

        Raises DriverError: ``not-enabled``, ``refused`` (nothing is sent), or ``lost``.
        """
        session = self._require_session()
        if self._tasks is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the arm is not enabled; enable it first")
        require_finite(setpoint, len(session.servos))
        self._notice_silence(session)
        with self._watching_the_port():
            if not session.health.starved:
                goals = [
                    task.bound(servo.counts(place))
                    for task, servo, place in zip(self._tasks, session.servos, setpoint.position.tolist(), strict=True)
                ]
                writes = goal_writes(goals, self._tasks, self._pace, self._clock.now_ns())
                session.bus.sync_write(
                    {servo: writes[joint] for joint, servo in enumerate(session.identifiers) if session.follows(joint)}
                )
            answers = session.bus.sync_read(session.identifiers, FEEDBACK)
            session.unsure |= {
                joint for joint, servo in enumerate(session.identifiers) if servo not in answers.statuses
            }
            session.watch_next()
        self._last_exchange_ns = self._clock.now_ns()
        return arm_state(session, answers)

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; legal at any time. `DAMP` is carried out as `HOLD`: these servos cannot damp."""
        session = self._session
        if session is None:
            self._tasks = None
            return self._blind()
        if self._tasks is not None:
            self._notice_silence(session)
        self._tasks = None
        try:
            with self._watching_the_port():
                stop_servos(session, policy)
                return self._observe(session)
        except DriverError as error:
            if self._session is None:
                return self._blind()
            return self._observe(session, silent_servo_fault(str(error)))

    def disconnect(self) -> None:
        """Let go of the port; an arm that is still enabled is stopped by its policy first."""
        if self._tasks is not None:
            self.stop(self._policy)
        self._session = None
        self._port.close()

    def _require_possible(self, mode: ControlMode, stop_policy: StopPolicy, watchdog_s: float) -> None:
        """Refuse what these servos cannot do."""
        shortest, longest = WATCHDOG_RANGE_S
        reason = None
        if self._tasks is not None:
            reason = "the arm is enabled already; stop it first"
        elif mode is not ControlMode.POSITION:
            reason = f"these servos cannot do mode {mode}; choose {ControlMode.POSITION}"
        elif stop_policy is not StopPolicy.HOLD:
            reason = f"these servos cannot {stop_policy} by themselves; choose {StopPolicy.HOLD}, then release the arm"
        elif not shortest <= watchdog_s <= longest:
            reason = f"a watchdog of {watchdog_s:g} s; give {shortest:g} to {longest:g} s"
        if reason is not None:
            raise DriverError(DriverErrorKind.REFUSED, reason)

    def _notice_silence(self, session: Session) -> None:
        """Latch the fault where the host was silent for too long."""
        silence_s = (self._clock.now_ns() - self._last_exchange_ns) * 1e-9
        session.health.starved |= silence_s > self._watchdog_s

    def _observe(self, session: Session, *failures: Fault) -> ArmState:
        """State without moving anything."""
        with self._watching_the_port():
            return observe(session, *failures)

    def _blind(self) -> ArmState:
        """State of an arm that cannot be seen."""
        return blind_state(self._clock.now_ns(), len(self._configuration.servos), self._lost)

    def _require_session(self) -> Session:
        if self._session is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the servos are not reached; connect first")
        return self._session

    @contextlib.contextmanager
    def _watching_the_port(self) -> Iterator[None]:
        """Give the session up where the port is gone: the servos hold their last goals."""
        try:
            yield
        except DriverError as error:
            if error.kind is DriverErrorKind.LOST:
                self._lost = (lost_bus_fault(str(error)),)
                self._session, self._tasks = None, None
                self._port.close()
                raise DriverError(error.kind, str(error), self._lost) from error
            raise

    def _cycle_parts(self) -> dict[str, float]:
        """Time of one cycle."""
        count, baud = len(self._configuration.servos), self._configuration.baud
        if self._session is None:
            return cycle_parts(count, baud, SHORTEST_RETURN_DELAY_S, adapter_latency_s(self._configuration.port))
        return cycle_parts(count, baud, self._session.bus.return_delay_s, self._port.latency_s)


def _describe_servos(session: Session) -> list[str]:
    """Supply and gains of each servo, for a model of its position loop."""
    lines: list[str] = []
    for joint, servo in enumerate(session.servos):
        settings, volts = session.settings[joint], session.read_feedback(joint)["Present Voltage"] * VOLT
        gains = ", ".join(f"{name} {settings[f'{name} Coefficient']}" for name in "PDI")
        lines.append(f"joint {servo.number}: STS3215 at {volts:.1f} V, {gains}")
    return lines
