"""An arm of STS3215 servos as a backend: what a cycle is made of."""

from collections.abc import Sequence

import numpy as np

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import Fault
from tauscope_drivers.feetech.bus import FeetechBus, count_traffic
from tauscope_drivers.feetech.commissioning import ServoTask
from tauscope_drivers.feetech.configuration import read_configuration
from tauscope_drivers.feetech.enabling import enable_servos, goal_writes, plan_tasks, stop_servos
from tauscope_drivers.feetech.packets import Status
from tauscope_drivers.feetech.registers import FEEDBACK, VOLT
from tauscope_drivers.feetech.session import Session, open_session
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.serial_port import expect_latency_s
from tauscope_drivers.serial_servos import bus
from tauscope_drivers.serial_servos.arm import SerialServoArm
from tauscope_drivers.state import ArmState, Setpoint

WATCHDOG_RANGE_S = (0.02, 2.5)  # silence of the host after which no goal is sent until the fault is acknowledged [s]

_NO_WATCHDOG = "the servos have no watchdog: without their host they hold their last goal"


class FeetechArm(SerialServoArm[Session]):
    """Implements `drivers.Backend` in position mode.

    These servos have no watchdog. One that hears nothing more goes on to its last goal, at most one cycle away, and
    holds it; the arm reports ``watchdog`` at the next call, and sends no goal until that is acknowledged. Effort is
    Present Load, the duty of the motor's bridge. Nothing is written to EEPROM.
    """

    def __init__(self, joints: Sequence[DriveJoint], *, slack_s: float = 0.002, clock: Clock | None = None) -> None:
        """Nothing is opened yet. Raises DriverError: ``refused``: a ``drive`` block is not valid."""
        super().__init__(read_configuration(joints), slack_s, clock)
        self._tasks: list[ServoTask] = []
        self._remarks: tuple[str, ...] = ()

    @property
    def capabilities(self) -> Capabilities:
        """What these servos can do; the rate is exact once they are reached."""
        return Capabilities(
            joint_count=len(self._configuration.servos),
            modes=frozenset([ControlMode.POSITION]),
            stop_policies=frozenset([StopPolicy.HOLD]),
            largest_rate_hz=bus.largest_rate_hz(*self._budget()),
            watchdog_range_s=WATCHDOG_RANGE_S,
            takes_feed_forward=False,
            effort_unit="permille",
            rate_limited_by=", ".join(bus.largest_part(*self._budget())),
            remarks=self._remarks,
        )

    def _open_session(self) -> Session:
        session = open_session(FeetechBus(self._port, self.clock), self._configuration.servos)
        self._remarks = (_NO_WATCHDOG, *_describe_servos(session))
        return session

    def _find_obstacle(self, mode: ControlMode, policy: StopPolicy, watchdog_s: float) -> str | None:
        shortest, longest = WATCHDOG_RANGE_S
        if mode is not ControlMode.POSITION:
            return f"these servos cannot do mode {mode}; choose {ControlMode.POSITION}"
        if policy is not StopPolicy.HOLD:
            return f"these servos cannot {policy} by themselves; choose {StopPolicy.HOLD}, then release the arm"
        if not shortest <= watchdog_s <= longest:
            return f"a watchdog of {watchdog_s:g} s; give {shortest:g} to {longest:g} s"
        return None

    def _read_faults(self, session: Session) -> tuple[Fault, ...]:
        for joint in range(len(session.servos)):
            session.read_targets(joint)
        return session.health.faults

    def _clear_faults(self, session: Session) -> tuple[Fault, ...]:
        session.health.forget()
        return self._read_faults(session)

    def _take_under_power(
        self, session: Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float, cycle_s: float | None
    ) -> GoalPace | None:
        tasks = plan_tasks(session, limits)
        held = enable_servos(session, tasks)
        self._tasks = tasks
        if cycle_s is None:
            return None
        return GoalPace(session.servos, held, [task.speed for task in tasks], cycle_s, self.clock.now_ns())

    def _cycle(self, session: Session, mode: ControlMode, setpoint: Setpoint) -> ArmState:
        """Sync Write of the goals, Sync Read of all servos, torque and limits of one servo."""
        self._notice_silence(session)
        if not session.health.starved:
            goals = [
                task.bound(servo.counts(place))
                for task, servo, place in zip(self._tasks, session.servos, setpoint.position.tolist(), strict=True)
            ]
            writes = goal_writes(goals, self._tasks, self._pace, self.clock.now_ns())
            session.bus.sync_write(
                {servo: writes[joint] for joint, servo in enumerate(session.identifiers) if session.follows(joint)}
            )
        answers = session.bus.sync_read(session.identifiers, FEEDBACK)
        session.unsure |= {joint for joint, servo in enumerate(session.identifiers) if servo not in answers.statuses}
        session.watch_next()
        return _arm_state(session, answers)

    def _stop(self, session: Session, policy: StopPolicy, *, was_enabled: bool) -> None:
        if was_enabled:
            self._notice_silence(session)
        stop_servos(session, policy)

    def _notice_silence(self, session: Session) -> None:
        """Latch the fault where the host was silent for too long."""
        silence_s = (self.clock.now_ns() - self._last_exchange_ns) * 1e-9
        session.health.starved |= silence_s > self._watchdog_s

    def _read_state(self, session: Session, *, is_health_fresh: bool) -> ArmState:
        for _ in range(bus.ATTEMPTS):
            answers = session.bus.sync_read(session.identifiers, FEEDBACK, bus.PATIENCE_S)
            if len(answers.statuses) == len(session.servos):
                break
        return _arm_state(session, answers)

    def _budget(self) -> tuple[bus.CycleTraffic, bus.BusTiming]:
        traffic = count_traffic(len(self._configuration.servos))
        if self._session is None:
            latency_s = expect_latency_s(self._port.path)
            return traffic, bus.BusTiming(self._port.baudrate, bus.SHORTEST_RETURN_DELAY_S, latency_s)
        return traffic, bus.BusTiming(self._port.baudrate, self._session.bus.return_delay_s, self._port.latency_s)


def _arm_state(session: Session, answers: bus.Answers[Status]) -> ArmState:
    position, velocity, load, temperature, voltage = np.full((5, len(session.servos)), np.nan)
    for joint, servo in enumerate(session.servos):
        if (status := answers.statuses.get(servo.servo)) is None:
            continue
        values = FEEDBACK.decode(status.data)
        position[joint] = servo.position(values["Present Position"])
        velocity[joint] = servo.velocity(values["Present Speed"])
        load[joint] = servo.load(values["Present Load"])
        temperature[joint], voltage[joint] = values["Present Temperature"], values["Present Voltage"] * VOLT
        session.health.alarms[joint] |= status.alarms
    return ArmState(
        time_ns=answers.asked_ns,
        position=position,
        velocity=velocity,
        effort=load,
        temperature=temperature,
        enabled=session.health.has_torque.copy(),
        faults=session.health.faults,
        late_ns=answers.late_ns,
        voltage=voltage,
    )


def _describe_servos(session: Session) -> list[str]:
    """Supply and gains of each servo, for a model of its position loop."""
    lines: list[str] = []
    for joint, servo in enumerate(session.servos):
        settings, volts = session.settings[joint], session.read_feedback(joint)["Present Voltage"] * VOLT
        gains = ", ".join(f"{name} {settings[f'{name} Coefficient']}" for name in "PDI")
        lines.append(f"joint {servo.number}: STS3215 at {volts:.1f} V, {gains}")
    return lines
