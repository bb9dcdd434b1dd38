"""An arm of servos on a serial bus as a backend: the order of calls, and what is refused."""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, Generic, TypeVar

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.limits import require_finite
from tauscope_drivers.serial_port import SerialPort
from tauscope_drivers.serial_servos.bus import BusTiming, CycleTraffic, require_rate
from tauscope_drivers.serial_servos.configuration import BusConfiguration
from tauscope_drivers.state import ArmState, Setpoint

_Session = TypeVar("_Session")


class SerialServoArm(ABC, Generic[_Session]):
    """Implements `drivers.Backend`; what depends on the protocol of the servos is the subclass's matter."""

    def __init__(self, configuration: BusConfiguration[Any], slack_s: float, clock: Clock | None) -> None:
        """Nothing is opened yet. `slack_s`: how much longer than the bus takes an answer is waited for [s]."""
        self._configuration = configuration
        self.clock = MonotonicClock() if clock is None else clock
        self._port = SerialPort(configuration.port, configuration.baud, slack_s)
        self._session: _Session | None = None
        self._mode: ControlMode | None = None
        self._policy = StopPolicy.HOLD
        self._pace: GoalPace | None = None
        self._watchdog_s = 0.0
        self._last_exchange_ns = 0
        self._lost: tuple[Fault, ...] = ()

    @property
    @abstractmethod
    def capabilities(self) -> Capabilities:
        """What these servos can do; the rate is exact once they are reached."""

    def require_rate(self, rate_hz: float) -> None:
        """Refuse a rate that the bus does not carry. Raises DriverError ``refused``, which names what limits it."""
        require_rate(rate_hz, *self._budget())

    def connect(self) -> ArmState:
        """Lock the port, reach every servo; moves nothing. Raises DriverError ``cannot-connect``: why."""
        if self._session is not None:
            raise DriverError.no_connection("the arm is connected already; disconnect it first")
        self._lost = ()
        self._port.open()
        try:
            self._session = self._open_session()
        except DriverError as error:
            self._port.close()
            raise DriverError.no_connection(str(error), error.faults) from error
        return self._observe(self._session, is_health_fresh=True)

    def acknowledge_faults(self) -> ArmState:
        """Forget faults whose cause is gone; stops the arm. Raises DriverError ``not-connected`` or ``fault``."""
        session = self._require_session()
        with self._watching_the_port():
            if self._mode is not None:
                self.stop(self._policy)
            _require_none(self._clear_faults(session))
        return self._observe(session, is_health_fresh=True)

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power where it stands. Raises DriverError: ``not-connected``, ``refused`` or ``fault``.

        `watchdog_s`: longest silence of the host; `cycle_s`: between goals; servos leap where it is None, or too short
        for the bus [s].
        """
        session = self._require_session()
        if self._mode is not None:
            raise DriverError.refusal("the arm is enabled already; stop it first")
        if reason := self._find_obstacle(mode, stop_policy, watchdog_s):
            raise DriverError.refusal(reason)
        with self._watching_the_port():
            _require_none(self._read_faults(session))
            self._pace = self._take_under_power(session, mode, limits, watchdog_s, cycle_s)
        self._mode, self._policy, self._watchdog_s = mode, stop_policy, watchdog_s
        self._last_exchange_ns = self.clock.now_ns()
        return self._observe(session, is_health_fresh=True)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """One cycle. Raises DriverError: ``not-enabled``, ``refused`` (nothing is sent), or ``lost``."""
        session = self._require_session()
        if self._mode is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the arm is not enabled; enable it first")
        require_finite(setpoint, len(self._configuration.servos))
        with self._watching_the_port():
            state = self._cycle(session, self._mode, setpoint)
        self._last_exchange_ns = self.clock.now_ns()
        return state

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; legal at any time. `DAMP` is carried out as `HOLD`: these servos cannot damp."""
        session, was_enabled = self._session, self._mode is not None
        self._mode = None
        if session is None:
            return self._blind()
        try:
            with self._watching_the_port():
                self._stop(session, policy, was_enabled=was_enabled)
                return self._observe(session)
        except DriverError as error:
            if self._session is None:
                return self._blind()
            remedy = "look at the arm; check the servo's power and cable, then stop again"
            state = self._observe(session)
            return replace(state, faults=(*state.faults, Fault("silent", None, str(error), remedy)))

    def disconnect(self) -> None:
        """Let go of the port; an arm that is still enabled is stopped by its policy first."""
        if self._mode is not None:
            self.stop(self._policy)
        if self._session is not None:
            self._leave(self._session)
        self._session = None
        self._port.close()

    @abstractmethod
    def _open_session(self) -> _Session:
        """Reach every servo on the open port."""

    @abstractmethod
    def _find_obstacle(self, mode: ControlMode, policy: StopPolicy, watchdog_s: float) -> str | None:
        """Why the servos cannot do by themselves what is asked when the host is gone; None where they can."""

    @abstractmethod
    def _read_faults(self, session: _Session) -> tuple[Fault, ...]: ...

    @abstractmethod
    def _clear_faults(self, session: _Session) -> tuple[Fault, ...]:
        """Clear what the operator knows of, and read what stays; moves nothing."""

    @abstractmethod
    def _take_under_power(
        self, session: _Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float, cycle_s: float | None
    ) -> GoalPace | None:
        """Check everything, then give torque; the pace of the goals where they are paced."""

    @abstractmethod
    def _cycle(self, session: _Session, mode: ControlMode, setpoint: Setpoint) -> ArmState: ...

    @abstractmethod
    def _stop(self, session: _Session, policy: StopPolicy, *, was_enabled: bool) -> None:
        """Stop all servos. Raises DriverError where one could not be reached; the others are stopped."""

    @abstractmethod
    def _read_state(self, session: _Session, *, is_health_fresh: bool) -> ArmState:
        """State without moving anything."""

    @abstractmethod
    def _budget(self) -> tuple[CycleTraffic, BusTiming]:
        """Traffic and timing of a cycle: as planned, or as found once the servos are reached."""

    def _leave(self, session: _Session) -> None:
        """Put back what a run changed."""

    def _observe(self, session: _Session, *, is_health_fresh: bool = False) -> ArmState:
        with self._watching_the_port():
            return self._read_state(session, is_health_fresh=is_health_fresh)

    def _blind(self) -> ArmState:
        return ArmState.unknown(self.clock.now_ns(), len(self._configuration.servos), self._lost)

    def _require_session(self) -> _Session:
        if self._session is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the servos are not reached; connect first")
        return self._session

    @contextlib.contextmanager
    def _watching_the_port(self) -> Iterator[None]:
        """Give the session up where the port is gone: what the arm does now is its servos' own doing."""
        try:
            yield
        except DriverError as error:
            if error.kind is DriverErrorKind.LOST:
                remedy = "check the adapter, its cable and its power, then connect again"
                self._lost = (Fault("lost-bus", None, str(error), remedy),)
                self._session, self._mode = None, None
                self._port.close()
                raise DriverError(error.kind, str(error), self._lost) from error
            raise


def act_on_each(joints: Iterable[int], act: Callable[[int], None], let_go: Callable[[int], None] | None = None) -> None:
    """Act on every servo, also after one that failed, which is `let_go`; the first failure is raised at the end."""
    failure: DriverError | None = None
    for joint in joints:
        try:
            act(joint)
        except DriverError as error:
            if error.kind is DriverErrorKind.LOST:
                raise
            if let_go is not None:
                let_go(joint)
            failure = failure or error
    if failure is not None:
        raise failure


def _require_none(faults: tuple[Fault, ...]) -> None:
    if faults:
        raise DriverError(DriverErrorKind.FAULT, f"{faults[0]}", faults)
