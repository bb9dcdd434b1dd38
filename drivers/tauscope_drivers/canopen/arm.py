"""An arm of CiA 402 drives on one CAN bus, as a backend: the order of calls, and what a cycle is made of."""

import math
from collections.abc import Sequence
from dataclasses import replace

import can
import numpy as np

from tauscope_drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.canopen import objects, power
from tauscope_drivers.canopen.bus import NMT_START, CanBus
from tauscope_drivers.canopen.commissioning import commission_drive, write_settings
from tauscope_drivers.canopen.configuration import read_configuration, require_targets
from tauscope_drivers.canopen.emergency import HEARTBEAT_LOST
from tauscope_drivers.canopen.node import BEATS, DriveNode
from tauscope_drivers.canopen.process_data import largest_rate_hz, rate_limit
from tauscope_drivers.canopen.session import SETTLING_CYCLE_S, Session, cycle_load, listed
from tauscope_drivers.canopen.state_machine import Goal
from tauscope_drivers.canopen.target_limiter import TargetLimiter
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.limits import RunawayWatch, TorqueWatch, require_finite, require_sensible
from tauscope_drivers.state import ArmState, Setpoint

WATCHDOG_RANGE_S = (0.02, 5.0)
PATIENCE_S = 0.002  # time that drives and adapter may take to answer SYNC, beyond twice that of the frames on the wire


class CanopenArm:
    """CiA 402 drives in cyclic synchronous position or torque mode; implements `drivers.Backend`.

    In each cycle the targets of all nodes go out, then SYNC, and the answers that SYNC asks for are collected. RPDOs
    are taken over and TPDOs sampled at SYNC, so that all joints are read at one instant.
    """

    def __init__(
        self,
        joints: Sequence[DriveJoint],
        bus: can.BusABC | None = None,
        *,
        patience_s: float = PATIENCE_S,
        clock: Clock | None = None,
    ) -> None:
        """Check the configuration; nothing is opened yet. Raises DriverError ``refused``: names joint and key."""
        self.configuration = read_configuration(joints)
        self._given_bus = bus
        self._patience_s = patience_s
        self._session: Session | None = None
        self._modes = frozenset(ControlMode)
        self._mode: ControlMode | None = None
        self._policy = StopPolicy.HOLD
        self._limiter: TargetLimiter | None = None
        self._runaway: RunawayWatch | None = None
        self._torque_watch: TorqueWatch | None = None
        self._caught: Fault | None = None
        self.clock = clock or MonotonicClock()

    @property
    def capabilities(self) -> Capabilities:
        """What bus and drives can do; the modes are the drives' own once connected."""
        return Capabilities(
            joint_count=len(self.configuration.nodes),
            modes=self._modes,
            stop_policies=frozenset(power.POLICY_GOALS),
            largest_rate_hz=largest_rate_hz(*cycle_load(self.configuration)),
            watchdog_range_s=WATCHDOG_RANGE_S,
            takes_feed_forward=False,
            rate_limited_by=rate_limit(*cycle_load(self.configuration)),
            holds_before_torque=False,
            remarks=() if self._session is None else self._session.remarks,
        )

    def connect(self) -> ArmState:
        """Open the bus, make sure that every node is a drive, and read it by SDO."""
        if self._session is not None:
            raise DriverError.no_connection("the arm is connected already; disconnect it first")
        session = self._session = self._open()
        try:
            self._modes = frozenset.intersection(*(node.identify() for node in session.nodes))
            session.make_pre_operational()
        except DriverError:
            self.disconnect()
            raise
        return session.read_by_sdo()

    def acknowledge_faults(self) -> ArmState:
        """Reset drives in fault, once, and forget emergencies; a drive that holds goes on holding."""
        session = self._require_session()
        self._mode = None
        state = power.reset_faults(session)
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"still in fault: {listed(state.faults)}", state.faults)
        return state

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Commission every drive, arm its heartbeat, enable all. `cycle_s`: of SYNCs; None: the drives' [s]."""
        session = self._require_session()
        if self._mode is not None:
            raise DriverError.refusal("the arm is enabled already; stop it first")
        self._refuse_impossible(mode, stop_policy, watchdog_s)
        for node in session.nodes:
            if write_settings(node):
                node.identify()
        state = session.read_by_sdo()
        require_sensible(limits, state.position, [node.place for node in session.nodes])
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"{listed(state.faults)}; acknowledge it first", state.faults)
        session.settling_ns = round((SETTLING_CYCLE_S if cycle_s is None else cycle_s) * 1e9)
        session.bus.start_heartbeat(watchdog_s / BEATS)
        try:
            for node in session.nodes:
                commission_drive(node, mode, limits, stop_policy, watchdog_s, cycle_s)
            _require_hold(session.nodes, mode, stop_policy)
            session.bus.command_nodes(NMT_START)
            self._mode, self._policy, session.brake = mode, stop_policy, None
            state, place = power.power_up(session, mode)
        except DriverError:
            self.stop(stop_policy)
            raise
        for node in session.nodes:
            node.glitches.limit = float(limits.velocity[node.joint - 1])
        self._limiter = TargetLimiter(limits, place, session.settling_ns * 1e-9)
        self._runaway = RunawayWatch(limits) if mode is ControlMode.TORQUE else None
        is_limited = [node.has(objects.LARGEST_TORQUE) for node in session.nodes]
        self._torque_watch = TorqueWatch(np.where(is_limited, np.inf, limits.torque))
        return state

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Targets out, SYNC, answers in; a node that does not answer in time leaves NaN."""
        session = self._require_session()
        mode, limiter = self._mode, self._limiter
        if mode is None or limiter is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the drives are not enabled; enable the arm first")
        require_finite(setpoint, len(session.nodes))
        session.bus.drain()
        missing = [node for node in session.nodes if node.error_code == HEARTBEAT_LOST]
        if len(missing) == len(session.nodes):
            return session.read_by_sdo()  # such drives take no process data any more
        if missing:
            return power.stop_promptly(session, mode, power.POLICY_GOALS[self._policy])
        targets = limiter.limited(setpoint, self.clock.now_ns())
        # a stop that has begun goes on, whatever is asked for meanwhile
        goal = Goal.OPERATION_ENABLED if session.caught is None and session.brake is None else Goal.QUICK_STOP
        targets = targets if goal is Goal.OPERATION_ENABLED else session.stop_targets()
        state = session.cycle(mode, goal, targets, session.answer_ns)
        if self._runaway is not None and session.caught is None:
            session.caught = self._runaway.look(state.position, state.velocity)
        if self._torque_watch is not None and session.caught is None:
            session.caught = self._torque_watch.look(state.effort)
        if goal is Goal.OPERATION_ENABLED and (session.caught is not None or state.faults):
            # one drive's trouble becomes that of all: they stop together
            return power.stop_promptly(session, mode, power.POLICY_GOALS[self._policy])
        return state

    def stop(self, policy: StopPolicy) -> ArmState:
        """Quick stop and hold, or ramp and let go; drives that are in such a state already stay as they are."""
        session, mode = self._session, self._mode
        if session is None:
            return ArmState.unknown(self.clock.now_ns(), len(self.configuration.nodes))
        goal = power.POLICY_GOALS.get(policy, Goal.QUICK_STOP)
        for node in session.nodes:
            node.glitches.limit = math.inf
        self._mode, self._limiter, self._runaway, self._torque_watch = None, None, None, None
        is_stopped = mode is not None and power.stop_in_cycle(session, mode, goal)
        silent = power.stop_one_by_one(session.nodes, goal, is_stopped=is_stopped)
        session.bus.start_heartbeat(0.0)
        state = session.observe(self.clock.now_ns())
        shall_hold = mode is not None and goal is Goal.QUICK_STOP and self._policy is policy
        dropped = power.dropped_faults(session.nodes) if shall_hold else []
        return replace(state, faults=(*state.faults, *silent, *dropped))

    def disconnect(self) -> None:
        """Let go of the bus; drives under power are stopped by their policy first."""
        session = self._session
        if session is None:
            return
        try:
            if self._mode is not None:
                self.stop(self._policy)
        finally:
            session.bus.close()
            self._caught = session.caught  # nobody has acknowledged it by reconnecting
            self._session, self._mode = None, None

    def _open(self) -> Session:
        bus = CanBus(self.configuration, self._given_bus, self.clock)
        nodes = tuple(DriveNode.on_bus(bus, node, joint) for joint, node in enumerate(self.configuration.nodes, 1))
        answer_s = 2.0 / largest_rate_hz(*cycle_load(self.configuration)) + self._patience_s
        return Session(bus, nodes, self.clock, round(answer_s * 1e9), self._caught)

    def _refuse_impossible(self, mode: ControlMode, policy: StopPolicy, watchdog_s: float) -> None:
        shortest, longest = WATCHDOG_RANGE_S
        if mode not in self._modes:
            raise DriverError.refusal(f"not every drive has the cyclic synchronous {mode} mode (0x6502)")
        if policy not in power.POLICY_GOALS:
            raise DriverError.refusal(f"drives cannot {policy} by themselves; choose hold or torque_off")
        if not shortest <= watchdog_s <= longest:
            raise DriverError.refusal(f"a watchdog of {watchdog_s:g} s is outside {shortest:g} to {longest:g} s")
        require_targets(self.configuration, mode)

    def _require_session(self) -> Session:
        if self._session is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the CAN bus is not open; connect first")
        return self._session


def _require_hold(nodes: Sequence[DriveNode], mode: ControlMode, policy: StopPolicy) -> None:
    """Refuse torque mode where a drive would fall at a stop that is to hold. Raises DriverError ``refused``."""
    falling = [node for node in nodes if not node.stays_stopped]
    if falling and mode is ControlMode.TORQUE and policy is StopPolicy.HOLD:
        raise DriverError.refusal(
            f"{falling[0].place}: has no power after a quick stop ({objects.QUICK_STOP_OPTION}), and cannot hold in "
            "torque mode; run in position mode, or state stop_policy torque_off for an arm that may be let go"
        )
