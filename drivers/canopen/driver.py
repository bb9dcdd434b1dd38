"""An arm of CiA 402 drives on one CAN bus, as a backend."""

import math
import time
from collections.abc import Callable, Sequence

import can
import numpy as np

from drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from drivers.canopen import objects
from drivers.canopen.bus import NMT_PRE_OPERATIONAL, NMT_START, SYNC_ID, CanBus
from drivers.canopen.bus_budget import CycleFrames, largest_rate_hz
from drivers.canopen.configuration import BusConfiguration, DriveJoint, read_configuration
from drivers.canopen.node import MOTION_PDO, RECEIVED_ID, STATE_PDO, TARGET_PDOS, DriveNode
from drivers.canopen.state_machine import DISABLE_VOLTAGE, FAULT_RESET, DriveState, Goal, next_controlword
from drivers.clock import MonotonicClock
from drivers.errors import DriverError, DriverErrorKind, Fault
from drivers.state import ArmState, Array, Setpoint

CYCLE_FRAMES = CycleFrames((TARGET_PDOS[ControlMode.POSITION].size,), (STATE_PDO.size, MOTION_PDO.size))
WATCHDOG_RANGE_S = (0.05, 2.0)
HEARTBEATS_A_WATCHDOG = 4
"""The master beats so often within a drive's watchdog time: one lost frame stops nothing."""

TRANSITION_S = 2.0
"""Time for all drives together to reach a power state."""

STOP_S = 0.5
"""Time for a stop by process data; drives that are not there by then are told one by one."""

SETTLING_CYCLE_S = 0.01
"""Cycle while drives change state, before and after the control loop's own."""

ANSWER_SPARE_S = 0.002
"""Time that drives and adapter may take to answer SYNC, beyond twice that of the frames on the wire."""

_SETTLING_NS = round(SETTLING_CYCLE_S * 1e9)
_UNDER_POWER = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
_POLICY_GOALS = {StopPolicy.HOLD: Goal.QUICK_STOP, StopPolicy.TORQUE_OFF: Goal.SWITCH_ON_DISABLED}


class CanopenArm:
    """CiA 402 drives in cyclic synchronous position or torque mode; implements `drivers.Backend`.

    In each cycle the targets of all nodes go out, then SYNC, and the answers that SYNC asks for are collected. RPDOs
    are taken over and TPDOs sampled at SYNC, so that all joints are read at one instant.
    """

    def __init__(self, joints: Sequence[DriveJoint], bus: can.BusABC | None = None) -> None:
        """Check the configuration; nothing is opened yet.

        Parameters
        ----------
        joints : sequence of DriveJoint
            base first
        bus : can.BusABC or None
            a bus that is open already, in place of the configured one

        Raises
        ------
        DriverError
            ``refused``: the configuration is not usable; names the joint and the key
        """
        self._configuration = read_configuration(joints)
        self._given_bus = bus
        self._bus: CanBus | None = None
        self._nodes: list[DriveNode] = []
        self._modes = frozenset(ControlMode)
        self._mode: ControlMode | None = None
        self._policy = StopPolicy.HOLD
        self._answer_ns = 0
        self.clock = MonotonicClock()

    @property
    def configuration(self) -> BusConfiguration:
        """Bus and drives."""
        return self._configuration

    @property
    def capabilities(self) -> Capabilities:
        """What bus and drives can do; the modes are the drives' own once connected."""
        settings = self._configuration
        rate = largest_rate_hz(len(settings.nodes), CYCLE_FRAMES, settings.bit_rate, settings.serial_baud)
        return Capabilities(
            joint_count=len(settings.nodes),
            modes=self._modes,
            stop_policies=frozenset(_POLICY_GOALS),
            largest_rate_hz=rate,
            watchdog_range_s=WATCHDOG_RANGE_S,
            takes_feed_forward=False,
        )

    def connect(self) -> ArmState:
        """Open the bus, make sure that every node is a drive, and read it by service data."""
        if self._bus is None:
            bus = CanBus(self._configuration, self._given_bus)
            self._bus = bus
            self._nodes = [
                DriveNode.on_bus(bus, node, joint) for joint, node in enumerate(self._configuration.nodes, 1)
            ]
            try:
                bus.command_nodes(NMT_PRE_OPERATIONAL)
                self._modes = frozenset.intersection(*(node.identify() for node in self._nodes))
            except DriverError:
                self.disconnect()
                raise
        return self._read_by_service_data()

    def acknowledge_faults(self) -> ArmState:
        """Reset drives in fault, once, and forget emergencies; a drive that holds goes on holding."""
        self._require_bus()
        self._mode = None
        for node in self._nodes:
            node.read_now()
            if node.state is DriveState.FAULT:
                node.dictionary.write(objects.CONTROLWORD, DISABLE_VOLTAGE)
                node.dictionary.write(objects.CONTROLWORD, FAULT_RESET)
                node.dictionary.write(objects.CONTROLWORD, DISABLE_VOLTAGE)
            node.error_code, node.acknowledged_code = 0, node.values[objects.ERROR_CODE]
        state = self._await(lambda: not any(node.faults() for node in self._nodes), self._read_by_service_data)
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"still in fault: {_listed(state.faults)}", state.faults)
        return state

    def enable(self, mode: ControlMode, limits: DriveLimits, stop_policy: StopPolicy, watchdog_s: float) -> ArmState:
        """Commission every drive, arm its heartbeat consumer, and take all to *operation enabled* together.

        Parameters
        ----------
        mode : ControlMode
            cyclic synchronous position or torque
        limits : DriveLimits
            of torque and position, which the drives enforce
        stop_policy : StopPolicy
            ``hold`` or ``torque_off``
        watchdog_s : float
            time without the master's heartbeat after which the drives stop [s]
        """
        bus = self._require_bus()
        self._refuse_impossible(mode, stop_policy, watchdog_s)
        state = self._read_by_service_data()
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"{_listed(state.faults)}; acknowledge it first", state.faults)
        bus.start_heartbeat(watchdog_s / HEARTBEATS_A_WATCHDOG)
        try:
            for index, node in enumerate(self._nodes):
                low, high = float(limits.position_low[index]), float(limits.position_high[index])
                torque = float(limits.torque[index])
                node.commission(mode, stop_policy, torque, low, high, round(watchdog_s * 1e3))
            bus.command_nodes(NMT_START)
            self._mode, self._policy = mode, stop_policy
            state = self._power_up(mode)
        except DriverError:
            self.stop(stop_policy)
            raise
        return state

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Targets out, SYNC, answers in; a node that does not answer in time leaves NaN.

        Parameters
        ----------
        setpoint : Setpoint
            finite targets
        """
        if self._mode is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the drives are not enabled; enable the arm first")
        target = setpoint.position if self._mode is ControlMode.POSITION else setpoint.torque
        if len(target) != len(self._nodes) or not np.isfinite(target).all():
            raise DriverError(
                DriverErrorKind.REFUSED, "a target is missing or not a finite number; nothing was sent to the drives"
            )
        return self._cycle(self._mode, Goal.OPERATION_ENABLED, setpoint, self._answer_ns)

    def stop(self, policy: StopPolicy) -> ArmState:
        """Quick stop and hold, or ramp and let go; drives that are in such a state already stay as they are.

        Parameters
        ----------
        policy : StopPolicy
            ``hold`` or ``torque_off``
        """
        if self._bus is None:
            return self._unknown()
        goal = _POLICY_GOALS.get(policy, Goal.QUICK_STOP)
        mode = self._mode
        self._mode = None
        if mode is not None and not self._stop_in_cycle(mode, goal):
            mode = None
        if mode is None:
            self._stop_by_service_data(goal)
        self._end_watch()
        return self._read_by_service_data()

    def disconnect(self) -> None:
        """Let go of the bus; drives under power are stopped by their policy first."""
        if self._bus is None:
            return
        try:
            if self._mode is not None:
                self.stop(self._policy)
        finally:
            self._bus.close()
            self._bus, self._nodes, self._mode = None, [], None

    def _refuse_impossible(self, mode: ControlMode, policy: StopPolicy, watchdog_s: float) -> None:
        """Refuse what these drives cannot do, before anything is switched on."""
        reason = None
        if mode not in self._modes:
            reason = f"not every drive has the cyclic synchronous {mode} mode (0x6502)"
        elif policy not in _POLICY_GOALS:
            reason = f"drives cannot {policy} by themselves; choose hold or torque_off"
        elif not WATCHDOG_RANGE_S[0] <= watchdog_s <= WATCHDOG_RANGE_S[1]:
            reason = f"a watchdog of {watchdog_s:g} s is outside {WATCHDOG_RANGE_S[0]:g} to {WATCHDOG_RANGE_S[1]:g} s"
        if reason is not None:
            raise DriverError(DriverErrorKind.REFUSED, reason)

    def _power_up(self, mode: ControlMode) -> ArmState:
        """Take all drives to *operation enabled*, targets at the present place in every cycle."""
        settings = self._configuration
        wire_s = 1.0 / largest_rate_hz(len(self._nodes), CYCLE_FRAMES, settings.bit_rate, settings.serial_baud)
        self._answer_ns = round((2.0 * wire_s + ANSWER_SPARE_S) * 1e9)

        def cycle() -> ArmState:
            still = Setpoint(self._present(), np.zeros(len(self._nodes)))
            return self._cycle(mode, Goal.OPERATION_ENABLED, still, _SETTLING_NS)

        def is_up() -> bool:
            return all(node.state is DriveState.OPERATION_ENABLED and node.follows for node in self._nodes)

        state = self._await(is_up, cycle)
        if not is_up():
            waiting = next(node for node in self._nodes if node.state is not DriveState.OPERATION_ENABLED)
            faults = state.faults
            text = _listed(faults) if faults else f"{waiting.place} stays in {waiting.state or 'an unknown state'}"
            kind = DriverErrorKind.FAULT if faults else DriverErrorKind.REFUSED
            raise DriverError(kind, f"the drives cannot be enabled: {text}", faults)
        return state

    def _stop_in_cycle(self, mode: ControlMode, goal: Goal) -> bool:
        """Stop by process data, all drives together; False where not all got there."""
        still = Setpoint(self._present(), np.zeros(len(self._nodes)))
        self._await(
            lambda: all(_has_stopped(node, goal) for node in self._nodes),
            lambda: self._cycle(mode, goal, still, _SETTLING_NS),
            STOP_S,
        )
        return all(_has_stopped(node, goal) for node in self._nodes)

    def _stop_by_service_data(self, goal: Goal) -> None:
        """Stop drives that no longer take process data, one by one; one that holds already stays as it is."""
        for node in self._nodes:
            node.read_now()
            word = next_controlword(node.state, goal)
            if goal is not Goal.QUICK_STOP or node.state is DriveState.OPERATION_ENABLED:
                node.dictionary.write(objects.CONTROLWORD, word)

    def _cycle(self, mode: ControlMode, goal: Goal, setpoint: Setpoint, answer_ns: int) -> ArmState:
        """One cycle on the bus."""
        bus = self._require_bus()
        pairs = zip(self._nodes, setpoint.position, setpoint.torque, strict=True)
        frames = [node.target(mode, node.controlword(goal), float(q), float(tau)) for node, q, tau in pairs]
        for node, frame in zip(self._nodes, frames, strict=True):
            node.values = {}
            bus.send(RECEIVED_ID + node.configuration.node_id, frame)
        bus.send(SYNC_ID, b"")
        stamp = time.monotonic_ns()
        deadline = stamp + answer_ns
        while not all(node.has_answered for node in self._nodes):
            if not bus.receive(deadline) and time.monotonic_ns() >= deadline:
                break
        bus.beat()
        return self._state(stamp)

    def _read_by_service_data(self) -> ArmState:
        """The arm as it stands, outside the cycle."""
        self._require_bus()
        for node in self._nodes:
            node.read_now()
        return self._state(time.monotonic_ns())

    def _state(self, stamp: int) -> ArmState:
        """What the nodes answered, in joint units; NaN where they did not."""
        columns: dict[str, list[float]] = {"position": [], "velocity": [], "effort": []}
        for node in self._nodes:
            for name, value in node.measured().items():
                columns[name].append(value)
        return ArmState(
            time_ns=stamp,
            position=np.array(columns["position"]),
            velocity=np.array(columns["velocity"]),
            effort=np.array(columns["effort"]),
            temperature=np.full(len(self._nodes), math.nan),
            enabled=np.array([node.state in _UNDER_POWER for node in self._nodes]),
            faults=tuple(fault for node in self._nodes for fault in node.faults()),
        )

    def _present(self) -> Array:
        """Where the joints are, by the last answer of each."""
        return np.array([node.last_position for node in self._nodes])

    def _await(
        self, is_reached: Callable[[], bool], step: Callable[[], ArmState], within_s: float = TRANSITION_S
    ) -> ArmState:
        """Go on stepping until something is reached or the time for it has passed; the last state."""
        deadline = time.monotonic_ns() + round(within_s * 1e9)
        state = step()
        while not is_reached() and time.monotonic_ns() < deadline:
            self.clock.wait_until_ns(state.time_ns + _SETTLING_NS)
            state = step()
        return state

    def _end_watch(self) -> None:
        """Let the drives no longer expect the master, and end its heartbeat: they keep their state without it."""
        bus = self._require_bus()
        try:
            for node in self._nodes:
                node.dictionary.write(objects.CONSUMER_HEARTBEAT, 0)
        finally:
            bus.start_heartbeat(0.0)

    def _require_bus(self) -> CanBus:
        if self._bus is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the CAN bus is not open; connect first")
        return self._bus

    def _unknown(self) -> ArmState:
        """The state of an arm that nobody is connected to."""
        nothing = np.full(len(self._configuration.nodes), math.nan)
        return ArmState(time.monotonic_ns(), nothing, nothing, nothing, nothing, np.zeros(len(nothing), dtype=bool))


def _has_stopped(node: DriveNode, goal: Goal) -> bool:
    """Whether a drive is where a stop takes it; one in fault has stopped by itself."""
    if goal is Goal.QUICK_STOP:
        return node.state in (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT)
    return node.state not in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, None)


def _listed(faults: Sequence[Fault]) -> str:
    return "; ".join(str(fault) for fault in faults)
