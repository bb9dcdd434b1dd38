"""An arm of Dynamixel servos as a backend: the order of calls, and what a cycle is made of."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.bus import PATIENCE_S, ServoBus
from tauscope_drivers.dynamixel.bus_budget import (
    BusTiming,
    CycleTraffic,
    found_budget,
    has_room_for_speeds,
    largest_part,
    largest_rate_hz,
    planned_budget,
    require_rate,
)
from tauscope_drivers.dynamixel.configuration import read_configuration
from tauscope_drivers.dynamixel.enabling import Bounds, enable_servos, goals_of
from tauscope_drivers.dynamixel.faults import lost_bus_fault, silent_servo_fault
from tauscope_drivers.dynamixel.group import GroupReading
from tauscope_drivers.dynamixel.models import WATCHDOG_MOST, WATCHDOG_STEP_S
from tauscope_drivers.dynamixel.preparation import commissioning_writes
from tauscope_drivers.dynamixel.session import Session, open_session
from tauscope_drivers.dynamixel.stopping import clear_errors, clear_watchdogs, stop_servos
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.limits import RunawayWatch, require_finite
from tauscope_drivers.serial_port import SerialPort
from tauscope_drivers.state import ArmState, Setpoint

Array = NDArray[np.float64]


def observe(session: Session, temperature: Array | None = None, *failures: Fault) -> ArmState:
    """State without moving anything, with the errors of servos that set their alert bit.

    `temperature`: (n,), where it was just read [°C].
    """
    reading = session.group.read_patiently()
    for joint, alert in enumerate(reading.alerts):
        if alert and not session.health.states_error(joint):
            servo = session.servos[joint]
            item = servo.model.error_item
            answer = session.bus.read_once(servo.servo, item.address, item.size, PATIENCE_S)
            if answer is not None and len(answer.data) == item.size:
                session.health.take(joint, {item.name: item.decode(answer.data, item.address)})
    unknown = np.full(len(session.servos), np.nan)
    state = arm_state(session, reading, unknown if temperature is None else temperature)
    return replace(state, faults=state.faults + failures)


def arm_state(session: Session, reading: GroupReading, temperature: Array) -> ArmState:
    """State of a cycle. `temperature`: (n,), where it was read in this cycle, else NaN [°C]."""
    for joint, alert in enumerate(reading.alerts):
        if alert is not None:
            session.health.take_alert(joint, alert)
    return ArmState(
        time_ns=reading.time_ns,
        position=reading.position,
        velocity=reading.velocity,
        effort=reading.current,
        temperature=temperature,
        enabled=session.enabled,
        faults=session.health.faults,
        late_ns=reading.late_ns,
    )


def blind_state(time_ns: int, joint_count: int, faults: tuple[Fault, ...]) -> ArmState:
    """State of an arm that cannot be seen."""
    unknown = np.full(joint_count, np.nan)
    return ArmState(time_ns, unknown, unknown, unknown, unknown, np.zeros(joint_count, dtype=np.bool_), faults)


_POLICIES = {
    ControlMode.POSITION: frozenset([StopPolicy.HOLD]),
    ControlMode.TORQUE: frozenset([StopPolicy.TORQUE_OFF]),
}
"""What the servos do by themselves when their watchdog fires."""

_SUSPECT_SILENCE = 0.8
"""Part of the watchdog's time after which a cycle asks all servos whether theirs has fired."""


class DynamixelArm:
    """Implements `drivers.Backend` for servos of the X, MX(2.0), P, PRO(A) and Y series.

    Positions are tracked under a cap of current (mode 5; mode 3 on P and Y); torque is commanded as current (mode 0).
    When a servo's watchdog fires it holds its place in the first and exerts no torque in the second, which is why
    `StopPolicy.HOLD` goes with positions and `StopPolicy.TORQUE_OFF` with torque. Servos that are given current keep no
    limit of position or speed: the driver does, and catches the arm by holding it. Effort is motor current.
    """

    def __init__(
        self,
        joints: Sequence[DriveJoint],
        *,
        slack_s: float = 0.002,
        keeps_settings: bool = False,
        clock: Clock | None = None,
    ) -> None:
        """Nothing is opened yet.

        Raises DriverError: ``refused``: a ``drive`` block is not valid.

        `keeps_settings`: whether changes of EEPROM stay after the arm is let go.
        """
        self._configuration = read_configuration(joints)
        self._clock = MonotonicClock() if clock is None else clock
        self._port = SerialPort(self._configuration.port, self._configuration.baud, slack_s)
        self._keeps_settings = keeps_settings
        self._session: Session | None = None
        self._mode: ControlMode | None = None
        self._policy = StopPolicy.HOLD
        self._bounds: Bounds | None = None
        self._watch: RunawayWatch | None = None
        self._pace: GoalPace | None = None
        self._watchdog_s = 0.0
        self._last_exchange_ns = 0
        self._last_goals: list[int] | None = None
        self._lost: tuple[Fault, ...] = ()

    @property
    def capabilities(self) -> Capabilities:
        """What these servos can do; the rate is exact once they are reached."""
        knows_torque = all(servo.torque_per_milliampere is not None for servo in self._configuration.servos)
        traffic, timing = self._budget()
        return Capabilities(
            joint_count=len(self._configuration.servos),
            modes=frozenset(ControlMode) if knows_torque else frozenset([ControlMode.POSITION]),
            stop_policies=frozenset().union(*_POLICIES.values()),
            largest_rate_hz=largest_rate_hz(traffic, timing),
            watchdog_range_s=(WATCHDOG_STEP_S, WATCHDOG_MOST * WATCHDOG_STEP_S),
            takes_feed_forward=False,
            effort_unit="mA",
            policies_by_mode=_POLICIES,
            rate_limited_by=", ".join(largest_part(traffic, timing)),
            holds_before_torque=False,
            remarks=() if self._session is None else self._session.changes,
        )

    @property
    def clock(self) -> Clock:
        """The machine's monotonic clock, where no other was given."""
        return self._clock

    def require_rate(self, rate_hz: float) -> None:
        """Refuse a rate that the bus does not carry. Raises DriverError ``refused``, which names what limits it."""
        require_rate(rate_hz, *self._budget())

    def connect(self) -> ArmState:
        """Lock the port and reach every servo; moves nothing and switches no torque on.

        Raises DriverError ``cannot-connect``: connected already, the port is taken or missing, a servo is missing or of
        the wrong kind.
        """
        if self._session is not None:
            raise DriverError(DriverErrorKind.CANNOT_CONNECT, "the arm is connected already; disconnect it first")
        self._lost = ()
        self._port.open()
        try:
            self._session = open_session(ServoBus(self._port, self._clock), self._configuration.servos)
        except DriverError as error:
            self._port.close()
            raise DriverError(DriverErrorKind.CANNOT_CONNECT, str(error), error.faults) from error
        return self._observe(self._session, self._session.health.temperature.copy())

    def acknowledge_faults(self) -> ArmState:
        """Clear watchdogs that have fired; an arm that is still enabled is stopped by its policy first.

        A hardware error (overload, heat …) stays until the servo was switched off and on: it is never restarted from
        here, for a restart lets go of the joint. Servos of the Y series forget errors without one, and are told to.
        Raises DriverError: ``not-connected``, or ``fault`` where a fault stays.
        """
        session = self._require_session()
        with self._watching_the_port():
            if self._mode is not None:
                self.stop(self._policy)
            session.health.forget()
            session.read_health()
            clear_watchdogs(session)
            session.read_health()
            clear_errors(session)
            for joint, servo in enumerate(session.servos):
                session.settings[joint] |= session.read(joint, ["Status Return Level"])
                holds = bool(session.health.has_torque[joint])
                session.carry_out(joint, commissioning_writes(servo, session.settings[joint], holds=holds))
            session.read_health()
        faults = session.health.faults
        if faults:
            raise DriverError(DriverErrorKind.FAULT, f"{faults[0]}", faults)
        return self._observe(session, session.health.temperature.copy())

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

        `watchdog_s`: time without `exchange` after which they do; rounded down to 20 ms [s].
        `cycle_s`: time between two goals, over which the servos go from one to the next; they leap where it is None, or
            too short for a bus that has to carry the speeds as well [s].
        """
        session = self._require_session()
        self._require_possible(mode, stop_policy)
        with self._watching_the_port():
            session.read_health()
            if faults := session.health.faults:
                raise DriverError(DriverErrorKind.FAULT, f"{faults[0]}", faults)
            self._bounds, held = enable_servos(session, mode, limits, watchdog_s)
        session.health.expect_torque(True)
        self._mode, self._policy, self._watchdog_s = mode, stop_policy, watchdog_s
        self._watch = RunawayWatch(limits) if mode is ControlMode.TORQUE else None
        self._pace = None
        if mode is ControlMode.POSITION and cycle_s is not None and has_room_for_speeds(*self._budget(), cycle_s):
            self._pace = GoalPace(session.servos, held, self._bounds.velocity, cycle_s, self._clock.now_ns())
        self._last_goals = None
        self._last_exchange_ns = self._clock.now_ns()
        return self._observe(session, session.health.temperature.copy())

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """One cycle: Sync Write of the goals, Sync Read of all servos, health of one servo.

        Raises DriverError: ``not-enabled``, ``refused`` (nothing is sent), or ``lost``.
        """
        session = self._require_session()
        if self._mode is None or self._bounds is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the arm is not enabled; enable it first")
        require_finite(setpoint, len(session.servos))
        name, goals = goals_of(session.servos, self._mode, self._bounds, setpoint)
        silence_s = (self._clock.now_ns() - self._last_exchange_ns) * 1e-9
        with self._watching_the_port():
            if session.health.runaway is None:
                self._send(session, name, goals)
            self._last_goals = goals if self._mode is ControlMode.POSITION else None
            reading = session.group.read()
            joint, values = session.group.read_health()
            suspects = session.group.read_watchdogs() if silence_s > _SUSPECT_SILENCE * self._watchdog_s else {}
            self._catch(session, reading)
        self._last_exchange_ns = self._clock.now_ns()
        for suspect, found in suspects.items():
            session.health.take(suspect, found)
        session.health.take(joint, values)
        temperature = np.full(len(session.servos), np.nan)
        temperature[joint] = values.get(session.servos[joint].model.temperature_item.name, np.nan)
        return arm_state(session, reading, temperature)

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; legal at any time. `DAMP` is carried out as `HOLD`: these servos cannot damp."""
        self._mode = None
        session = self._session
        if session is None:
            return self._blind()
        caps = [values["Current Limit"] for values in session.settings]
        if self._bounds is not None:
            caps = list(self._bounds.current)
        try:
            with self._watching_the_port():
                stop_servos(session, policy, caps, self._last_goals)
                return self._observe(session)
        except DriverError as error:
            if self._session is None:
                return self._blind()
            return self._observe(session, None, silent_servo_fault(str(error)))

    def disconnect(self) -> None:
        """Let go of the port; an arm that is still enabled is stopped by its policy first."""
        if self._mode is not None:
            self.stop(self._policy)
        if self._session is not None and not self._keeps_settings:
            # a servo that does not answer now has them put back with the next release
            with contextlib.suppress(DriverError):
                self._session.restore()
        self._session = None
        self._port.close()

    def _require_possible(self, mode: ControlMode, policy: StopPolicy) -> None:
        """Refuse what servos cannot do by themselves when the host is gone."""
        refused = DriverErrorKind.REFUSED
        if self._mode is not None:
            raise DriverError(refused, "the arm is enabled already; stop it first")
        if mode not in self.capabilities.modes:
            raise DriverError(
                refused, "torque cannot be commanded as current without joints[].torque_constant; state it"
            )
        if policy not in _POLICIES[mode]:
            (wanted,) = _POLICIES[mode]
            raise DriverError(
                refused,
                f"in {mode} mode the servos' watchdog ends in {wanted}, not in {policy}; ask for {wanted}"
                + ("" if mode is ControlMode.POSITION else ", or track positions"),
            )

    def _send(self, session: Session, name: str, goals: list[int]) -> None:
        """Write the goals of a cycle, each with the speed that takes until the next."""
        if self._pace is None:
            session.group.write(name, goals)
        else:
            session.group.write_goals(goals, self._pace.speeds(goals, self._clock.now_ns()))

    def _catch(self, session: Session, reading: GroupReading) -> None:
        """Hold an arm that leaves its limits while it is given current: its servos would let it."""
        if self._watch is None or self._bounds is None or session.health.runaway is not None:
            return
        session.health.runaway = self._watch.look(reading.position, reading.velocity)
        if session.health.runaway is None:
            return
        try:
            stop_servos(session, StopPolicy.HOLD, self._bounds.current, None)
        except DriverError as error:
            # A servo that does not answer is told of by its missing samples.
            if error.kind is DriverErrorKind.LOST:
                raise

    def _observe(self, session: Session, temperature: Array | None = None, *failures: Fault) -> ArmState:
        """State without moving anything."""
        with self._watching_the_port():
            return observe(session, temperature, *failures)

    def _blind(self) -> ArmState:
        """State of an arm that cannot be seen."""
        return blind_state(self._clock.now_ns(), len(self._configuration.servos), self._lost)

    def _require_session(self) -> Session:
        if self._session is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the servos are not reached; connect first")
        return self._session

    @contextlib.contextmanager
    def _watching_the_port(self) -> Iterator[None]:
        """Give the session up where the port is gone: what the arm does now is its servos' watchdogs' doing."""
        try:
            yield
        except DriverError as error:
            if error.kind is DriverErrorKind.LOST:
                self._lost = (lost_bus_fault(str(error)),)
                self._session, self._mode = None, None
                self._port.close()
                raise DriverError(error.kind, str(error), self._lost) from error
            raise

    def _budget(self) -> tuple[CycleTraffic, BusTiming]:
        """Traffic and timing of a cycle."""
        return planned_budget(self._configuration) if self._session is None else found_budget(self._session)
