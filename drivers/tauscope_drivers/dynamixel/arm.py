"""An arm of Dynamixel servos as a backend: what a cycle is made of."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.bus import ServoBus, count_traffic, has_room_for_speeds, planned_budget
from tauscope_drivers.dynamixel.configuration import read_configuration
from tauscope_drivers.dynamixel.control_table import WATCHDOG_MOST, WATCHDOG_STEP_S
from tauscope_drivers.dynamixel.enabling import enable_servos, goals_of
from tauscope_drivers.dynamixel.group import GroupReading
from tauscope_drivers.dynamixel.preparation import ServoTask, commissioning_writes
from tauscope_drivers.dynamixel.session import Session, open_session
from tauscope_drivers.dynamixel.stopping import clear_errors, clear_watchdogs, stop_servos
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.limits import RunawayWatch
from tauscope_drivers.serial_servos.arm import SerialServoArm
from tauscope_drivers.serial_servos.bus import PATIENCE_S, BusTiming, CycleTraffic, largest_part, largest_rate_hz
from tauscope_drivers.state import ArmState, Array, Setpoint

# what the servos do by themselves when their watchdog fires
_POLICIES = {ControlMode.POSITION: frozenset([StopPolicy.HOLD]), ControlMode.TORQUE: frozenset([StopPolicy.TORQUE_OFF])}
_SUSPECT_SILENCE = 0.8  # part of the watchdog's time after which a cycle asks all servos whether theirs has fired


class DynamixelArm(SerialServoArm[Session]):
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
        """Nothing is opened yet. Raises DriverError ``refused``. `keeps_settings`: changes of EEPROM stay."""
        super().__init__(read_configuration(joints), slack_s, clock)
        self._keeps_settings = keeps_settings
        self._tasks: list[ServoTask] = []
        self._watch: RunawayWatch | None = None
        self._last_goals: list[int] | None = None

    @property
    def capabilities(self) -> Capabilities:
        """What these servos can do; the rate is exact once they are reached."""
        knows_torque = all(servo.torque_per_milliampere is not None for servo in self._configuration.servos)
        return Capabilities(
            joint_count=len(self._configuration.servos),
            modes=frozenset(ControlMode) if knows_torque else frozenset([ControlMode.POSITION]),
            stop_policies=frozenset().union(*_POLICIES.values()),
            largest_rate_hz=largest_rate_hz(*self._budget()),
            watchdog_range_s=(WATCHDOG_STEP_S, WATCHDOG_MOST * WATCHDOG_STEP_S),
            takes_feed_forward=False,
            effort_unit="mA",
            policies_by_mode=_POLICIES,
            rate_limited_by=", ".join(largest_part(*self._budget())),
            holds_before_torque=False,
            remarks=() if self._session is None else self._session.changes,
        )

    def _open_session(self) -> Session:
        return open_session(ServoBus(self._port, self.clock), self._configuration.servos)

    def _find_obstacle(self, mode: ControlMode, policy: StopPolicy, watchdog_s: float) -> str | None:
        if mode not in self.capabilities.modes:
            return "torque cannot be commanded as current without joints[].torque_constant; state it"
        (wanted,) = _POLICIES[mode]
        if policy is not wanted:
            other = "" if mode is ControlMode.POSITION else ", or track positions"
            return f"in {mode} mode the servos' watchdog ends in {wanted}, not in {policy}; ask for {wanted}{other}"
        return None

    def _read_faults(self, session: Session) -> tuple[Fault, ...]:
        session.read_health()
        return session.health.faults

    def _clear_faults(self, session: Session) -> tuple[Fault, ...]:
        """Clear watchdogs that have fired.

        A hardware error (overload, heat …) stays until the servo was switched off and on: it is never restarted from
        here, for a restart lets go of the joint. Servos of the Y series forget errors without one, and are told to.
        """
        session.health.forget()
        session.read_health()
        clear_watchdogs(session)
        session.read_health()
        clear_errors(session)
        for joint, servo in enumerate(session.servos):
            session.settings[joint] |= session.read(joint, ["Status Return Level"])
            holds = bool(session.health.has_torque[joint])
            session.carry_out(joint, commissioning_writes(servo, session.settings[joint], holds=holds))
        return self._read_faults(session)

    def _take_under_power(
        self, session: Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float, cycle_s: float | None
    ) -> GoalPace | None:
        self._tasks, held = enable_servos(session, mode, limits, watchdog_s)
        session.health.expect_torque(True)
        self._watch = RunawayWatch(limits) if mode is ControlMode.TORQUE else None
        self._last_goals = None
        if mode is ControlMode.TORQUE or cycle_s is None or not has_room_for_speeds(*self._budget(), cycle_s):
            return None
        return GoalPace(session.servos, held, [task.velocity_cap for task in self._tasks], cycle_s, self.clock.now_ns())

    def _cycle(self, session: Session, mode: ControlMode, setpoint: Setpoint) -> ArmState:
        """Sync Write of the goals, Sync Read of all servos, health of one servo."""
        name, goals = goals_of(session.servos, mode, self._tasks, setpoint)
        silence_s = (self.clock.now_ns() - self._last_exchange_ns) * 1e-9
        if session.health.runaway is None:
            if self._pace is None:
                session.group.write(name, goals)
            else:
                session.group.write_goals(goals, self._pace.speeds(goals, self.clock.now_ns()))
        self._last_goals = goals if mode is ControlMode.POSITION else None
        reading = session.group.read()
        joint, values = session.group.read_health()
        suspects = session.group.read_watchdogs() if silence_s > _SUSPECT_SILENCE * self._watchdog_s else {}
        self._catch(session, reading)
        for suspect, found in suspects.items():
            session.health.take(suspect, found)
        session.health.take(joint, values)
        temperature = np.full(len(session.servos), np.nan)
        temperature[joint] = values.get(session.servos[joint].model.temperature_item.name, np.nan)
        return _arm_state(session, reading, temperature)

    def _stop(self, session: Session, policy: StopPolicy, *, was_enabled: bool) -> None:
        caps = [task.current_cap for task in self._tasks] or [values["Current Limit"] for values in session.settings]
        stop_servos(session, policy, caps, self._last_goals)

    def _leave(self, session: Session) -> None:
        if not self._keeps_settings:
            # a servo that does not answer now has them put back with the next release
            with contextlib.suppress(DriverError):
                session.restore()

    def _catch(self, session: Session, reading: GroupReading) -> None:
        """Hold an arm that leaves its limits while it is given current: its servos would let it."""
        if self._watch is None or session.health.runaway is not None:
            return
        session.health.runaway = self._watch.look(reading.state.position, reading.state.velocity)
        if session.health.runaway is None:
            return
        try:
            stop_servos(session, StopPolicy.HOLD, [task.current_cap for task in self._tasks], None)
        except DriverError as error:
            # A servo that does not answer is told of by its missing samples.
            if error.kind is DriverErrorKind.LOST:
                raise

    def _read_state(self, session: Session, *, is_health_fresh: bool) -> ArmState:
        """State, with the errors of servos that set their alert bit."""
        temperature = session.health.temperature.copy() if is_health_fresh else np.full(len(session.servos), np.nan)
        reading = session.group.read_patiently()
        for joint, alert in enumerate(reading.alerts):
            if alert and not session.health.states_error(joint):
                servo = session.servos[joint]
                item = servo.model.error_item
                answer = session.bus.read_once(servo.servo, item.address, item.size, PATIENCE_S)
                if answer is not None and len(answer.data) == item.size:
                    session.health.take(joint, {item.name: item.decode(answer.data, item.address)})
        return _arm_state(session, reading, temperature)

    def _budget(self) -> tuple[CycleTraffic, BusTiming]:
        if (session := self._session) is None:
            return planned_budget(self._configuration)
        longest = max(block.length for servo in session.servos for block in servo.model.watched_blocks)
        fast, families = session.group.fast, len(session.group.families)
        traffic = count_traffic(len(session.servos), health_bytes=longest, fast=fast, families=families)
        return traffic, BusTiming(self._port.baudrate, session.bus.return_delay_s, self._port.latency_s)


def _arm_state(session: Session, reading: GroupReading, temperature: Array) -> ArmState:
    """State of a cycle. `temperature`: (n,), where it was read in this cycle, else NaN [°C]."""
    for joint, alert in enumerate(reading.alerts):
        if alert is not None:
            session.health.alerts[joint] = alert
    return replace(reading.state, temperature=temperature, enabled=session.enabled, faults=session.health.faults)
