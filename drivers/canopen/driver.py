"""An arm of CiA 402 drives on one CAN bus, as a backend."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import can
import numpy as np

from drivers.backend import Capabilities, ControlMode, DriveLimits, StopPolicy
from drivers.canopen import objects
from drivers.canopen.bus import NMT_PRE_OPERATIONAL, NMT_START, SYNC_ID, CanBus
from drivers.canopen.bus_budget import CycleFrames, largest_rate_hz
from drivers.canopen.configuration import BusConfiguration, DriveJoint, read_configuration
from drivers.canopen.emergency import HEARTBEAT_LOST, WATCHDOG_CODE
from drivers.canopen.node import MOTION_PDO, RECEIVED_ID, STATE_PDO, TARGET_PDOS, DriveNode
from drivers.canopen.state_machine import DISABLE_VOLTAGE, FAULT_RESET, DriveState, Goal, next_controlword
from drivers.canopen.target_limiter import TargetLimiter
from drivers.clock import Clock, MonotonicClock
from drivers.errors import DriverError, DriverErrorKind, Fault
from drivers.limits import RunawayWatch, require_finite, require_sensible
from drivers.state import ArmState, Array, Setpoint

CYCLE_FRAMES = CycleFrames((TARGET_PDOS[ControlMode.POSITION].size,), (STATE_PDO.size, MOTION_PDO.size))
WATCHDOG_RANGE_S = (0.02, 5.0)
HEARTBEATS_A_WATCHDOG = 10
"""The master beats so often within a drive's watchdog time: one lost frame stops nothing."""

TRANSITION_S = 2.0
"""Time for all drives together to reach a power state."""

RESET_S = 0.1
"""Time in which a drive leaves its fault, or is back in it because the cause persists."""

STOP_S = 0.5
"""Time for a stop by process data; drives that are not there by then are told one by one."""

STILL_CYCLES = 4
"""Cycles at one place before anything moves: drives interpolate between the last few targets."""

SETTLING_CYCLE_S = 0.01
"""Cycle while drives change state, before and after the control loop's own, where that is not known."""

PATIENCE_S = 0.002
"""Time that drives and adapter may take to answer SYNC, beyond twice that of the frames on the wire."""

_SILENT_REMEDY = "support the arm, check the drive's cable and power, then acknowledge"
_RESTART_REMEDY = "support the arm, look for a dip of its supply, then acknowledge"
_UNDER_POWER = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
_POLICY_GOALS = {StopPolicy.HOLD: Goal.QUICK_STOP, StopPolicy.TORQUE_OFF: Goal.SWITCH_ON_DISABLED}


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
        """Check the configuration; nothing is opened yet.

        Parameters
        ----------
        joints : sequence of DriveJoint
            base first
        bus : can.BusABC or None
            a bus that is open already, in place of the configured one
        patience_s : float
            how much longer than the bus takes an answer is waited for [s]
        clock : Clock or None
            that the arm runs by; the machine's where None

        Raises
        ------
        DriverError
            ``refused``: the configuration is not usable; names the joint and the key
        """
        self._configuration = read_configuration(joints)
        self._given_bus = bus
        self._patience_s = patience_s
        self._bus: CanBus | None = None
        self._nodes: list[DriveNode] = []
        self._modes = frozenset(ControlMode)
        self._mode: ControlMode | None = None
        self._policy = StopPolicy.HOLD
        self._answer_ns, self._settling_ns = 0, round(SETTLING_CYCLE_S * 1e9)
        self._limiter: TargetLimiter | None = None
        self._runaway: RunawayWatch | None = None
        self._caught: Fault | None = None
        self.clock = clock or MonotonicClock()

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
            holds_before_torque=False,
        )

    def connect(self) -> ArmState:
        """Open the bus, make sure that every node is a drive, and read it by service data."""
        if self._bus is not None:
            raise DriverError(DriverErrorKind.CANNOT_CONNECT, "the arm is connected already; disconnect it first")
        bus = CanBus(self._configuration, self._given_bus, self.clock)
        self._bus = bus
        self._nodes = [DriveNode.on_bus(bus, node, joint) for joint, node in enumerate(self._configuration.nodes, 1)]
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
        self._mode, self._caught = None, None
        for node in self._nodes:
            node.read_now()
            if node.state is DriveState.FAULT:
                node.dictionary.write(objects.CONTROLWORD, DISABLE_VOLTAGE)
                node.dictionary.write(objects.CONTROLWORD, FAULT_RESET)
                node.dictionary.write(objects.CONTROLWORD, DISABLE_VOLTAGE)
            node.error_code, node.acknowledged_code = 0, node.values[objects.ERROR_CODE]
        # a drive whose cause persists needs a moment to be back in its fault
        self.clock.wait_until_ns(self.clock.now_ns() + self._settling_ns)
        state = self._await(self._is_sound, self._read_by_service_data, RESET_S)
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"still in fault: {_listed(state.faults)}", state.faults)
        return state

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
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
        cycle_s : float or None
            time between two SYNCs, over which the drives interpolate; they keep the one that they know where None [s]
        """
        bus = self._require_bus()
        if self._mode is not None:
            raise DriverError(DriverErrorKind.REFUSED, "the arm is enabled already; stop it first")
        self._refuse_impossible(mode, stop_policy, watchdog_s)
        state = self._read_by_service_data()
        require_sensible(limits, state.position, [node.place for node in self._nodes])
        if state.faults:
            raise DriverError(DriverErrorKind.FAULT, f"{_listed(state.faults)}; acknowledge it first", state.faults)
        self._settling_ns = round((SETTLING_CYCLE_S if cycle_s is None else cycle_s) * 1e9)
        bus.start_heartbeat(watchdog_s / HEARTBEATS_A_WATCHDOG)
        try:
            for index, node in enumerate(self._nodes):
                low, high = float(limits.position_low[index]), float(limits.position_high[index])
                torque = float(limits.torque[index])
                node.commission(mode, stop_policy, torque, low, high, round(watchdog_s * 1e3), cycle_s)
            bus.command_nodes(NMT_START)
            self._mode, self._policy = mode, stop_policy
            state = self._power_up(mode, limits)
        except DriverError:
            self.stop(stop_policy)
            raise
        self._runaway = RunawayWatch(limits) if mode is ControlMode.TORQUE else None
        return state

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Targets out, SYNC, answers in; a node that does not answer in time leaves NaN.

        Parameters
        ----------
        setpoint : Setpoint
            finite targets
        """
        bus = self._require_bus()
        mode, limiter = self._mode, self._limiter
        if mode is None or limiter is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the drives are not enabled; enable the arm first")
        require_finite(setpoint, len(self._nodes))
        bus.drain()
        if any(node.error_code == HEARTBEAT_LOST for node in self._nodes):
            return self._read_by_service_data()  # such a drive takes no process data any more
        goal = Goal.OPERATION_ENABLED if self._caught is None else Goal.QUICK_STOP
        state = self._cycle(mode, goal, limiter.limited(setpoint, self.clock.now_ns()), self._answer_ns)
        if self._runaway is not None and self._caught is None:
            self._caught = self._runaway.look(state.position, state.velocity)
        if goal is Goal.OPERATION_ENABLED and (self._caught is not None or state.faults):
            return self._halted(mode)
        return state

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
        was_enabled = mode is not None
        self._mode, self._limiter, self._runaway = None, None, None
        if mode is not None and not self._stop_in_cycle(mode, goal):
            mode = None
        silent = self._stop_one_by_one(goal, is_stopped=mode is not None)
        self._require_bus().start_heartbeat(0.0)
        state = self._state(self.clock.now_ns())
        dropped = self._dropped() if was_enabled and goal is Goal.QUICK_STOP and self._policy is policy else []
        return replace(state, faults=(*state.faults, *silent, *dropped))

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

    def _halted(self, mode: ControlMode) -> ArmState:
        """The arm after one drive's trouble became that of all: they stop together."""
        still = Setpoint(self._present(), np.zeros(len(self._nodes)))
        return self._cycle(mode, _POLICY_GOALS[self._policy], still, self._answer_ns)

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

    def _power_up(self, mode: ControlMode, limits: DriveLimits) -> ArmState:
        """Take all drives to *operation enabled*; targets are where the joints are when their drives get there."""
        settings = self._configuration
        wire_s = 1.0 / largest_rate_hz(len(self._nodes), CYCLE_FRAMES, settings.bit_rate, settings.serial_baud)
        self._answer_ns = round((2.0 * wire_s + self._patience_s) * 1e9)

        place = self._settled_place(mode)

        def cycle() -> ArmState:
            for index, node in enumerate(self._nodes):
                if node.last_state is not DriveState.OPERATION_ENABLED:
                    place[index] = node.last_position
            still = Setpoint(place, np.zeros(len(self._nodes)))
            return self._cycle(mode, Goal.OPERATION_ENABLED, still, self._unhurried_ns)

        def is_up() -> bool:
            return all(node.last_state is DriveState.OPERATION_ENABLED for node in self._nodes)

        state = self._await(is_up, cycle)
        self._limiter = TargetLimiter(limits, place, self._settling_ns * 1e-9)
        for _ in range(STILL_CYCLES):
            self.clock.wait_until_ns(state.time_ns + self._settling_ns)
            state = cycle()
        if not is_up():
            waiting = next(node for node in self._nodes if node.last_state is not DriveState.OPERATION_ENABLED)
            faults = state.faults
            text = _listed(faults) if faults else f"{waiting.place} stays in {waiting.last_state or 'an unknown state'}"
            kind = DriverErrorKind.FAULT if faults else DriverErrorKind.REFUSED
            raise DriverError(kind, f"the drives cannot be enabled: {text}", faults)
        return state

    def _settled_place(self, mode: ControlMode) -> Array:
        """Where the joints are now, by process data, read before any drive changes its state.

        One that holds may be back under power with its first target: that must not be where it was when commissioning
        began.
        """
        stay = Setpoint(self._present(), np.zeros(len(self._nodes)))

        def cycle() -> ArmState:
            for node in self._nodes:
                if not node.has_answered:  # it may have missed that it shall take process data
                    self._require_bus().command_nodes(NMT_START, node.configuration.node_id)
            return self._cycle(mode, Goal.QUICK_STOP, stay, self._unhurried_ns)

        self._await(lambda: all(node.has_answered for node in self._nodes), cycle)
        return self._present()

    def _stop_in_cycle(self, mode: ControlMode, goal: Goal) -> bool:
        """Stop by process data, all drives together; False where not all got there."""
        still = Setpoint(self._present(), np.zeros(len(self._nodes)))
        self._await(
            lambda: all(_has_stopped(node, goal) for node in self._nodes),
            lambda: self._cycle(mode, goal, still, self._unhurried_ns),
            STOP_S,
        )
        return all(_has_stopped(node, goal) for node in self._nodes)

    @property
    def _unhurried_ns(self) -> int:
        """Time for an answer while drives change state: no motion waits for the next cycle [ns]."""
        return max(self._answer_ns, self._settling_ns)

    def _stop_one_by_one(self, goal: Goal, *, is_stopped: bool) -> list[Fault]:
        """Stop drives that no longer take process data, let all forget the master, and read them.

        One that holds already stays as it is. A fault for each drive that does not answer: the others are stopped all
        the same.
        """
        silent: list[Fault] = []
        for node in self._nodes:
            try:
                node.read_now()
                if not is_stopped and (goal is not Goal.QUICK_STOP or node.state is DriveState.OPERATION_ENABLED):
                    node.dictionary.write(objects.CONTROLWORD, next_controlword(node.state, goal))
                node.dictionary.write(objects.CONSUMER_HEARTBEAT, 0)
                node.read_now()
            except DriverError as error:
                if error.kind is DriverErrorKind.LOST:
                    raise
                node.values = {}
                silent.append(Fault("silent", node.joint, "did not answer while it was stopped", _SILENT_REMEDY))
        return silent

    def _dropped(self) -> list[Fault]:
        """Drives that should hold and have no power, and do not say why: they were restarted."""
        return [
            Fault("not-held", node.joint, f"is without power ({node.state}) after a stop that holds", _RESTART_REMEDY)
            for node in self._nodes
            if node.state in (DriveState.SWITCH_ON_DISABLED, DriveState.READY, DriveState.SWITCHED_ON)
        ]

    def _cycle(self, mode: ControlMode, goal: Goal, setpoint: Setpoint, answer_ns: int) -> ArmState:
        """One cycle on the bus."""
        bus = self._require_bus()
        pairs = zip(self._nodes, setpoint.position, setpoint.torque, strict=True)
        frames = [node.target(mode, node.controlword(goal), float(q), float(tau)) for node, q, tau in pairs]
        bus.drain()
        for node, frame in zip(self._nodes, frames, strict=True):
            node.values = {}
            bus.send(RECEIVED_ID + node.configuration.node_id, frame)
        bus.send(SYNC_ID, b"")
        stamp, deadline = self.clock.now_ns(), time.monotonic_ns() + answer_ns
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
        return self._state(self.clock.now_ns())

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
            # of a node that did not answer, as it last told: whether it is missed is what NaN says
            enabled=np.array([node.last_state in _UNDER_POWER for node in self._nodes]),
            faults=self._faults(),
        )

    def _faults(self) -> tuple[Fault, ...]:
        """What drives report and what the driver itself has caught; a host that fell silent is one fault of the arm."""
        reported = [fault for node in self._nodes for fault in node.faults()]
        silence = [replace(fault, joint=None) for fault in reported if fault.code == WATCHDOG_CODE]
        caught = [] if self._caught is None else [self._caught]
        return (*caught, *silence[:1], *(fault for fault in reported if fault.code != WATCHDOG_CODE))

    def _is_sound(self) -> bool:
        """Whether nothing is in fault."""
        return not self._faults()

    def _present(self) -> Array:
        """Where the joints are, by the last answer of each."""
        return np.array([node.last_position for node in self._nodes])

    def _await(
        self, is_reached: Callable[[], bool], step: Callable[[], ArmState], within_s: float = TRANSITION_S
    ) -> ArmState:
        """Go on stepping until something is reached or the time for it has passed; the last state."""
        deadline = self.clock.now_ns() + round(within_s * 1e9)
        state = step()
        while not is_reached() and self.clock.now_ns() < deadline:
            self.clock.wait_until_ns(state.time_ns + self._settling_ns)
            state = step()
        return state

    def _require_bus(self) -> CanBus:
        if self._bus is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the CAN bus is not open; connect first")
        return self._bus

    def _unknown(self) -> ArmState:
        """The state of an arm that nobody is connected to."""
        nothing = np.full(len(self._configuration.nodes), math.nan)
        return ArmState(self.clock.now_ns(), nothing, nothing, nothing, nothing, np.zeros(len(nothing), dtype=bool))


def _has_stopped(node: DriveNode, goal: Goal) -> bool:
    """Whether a drive is where a stop takes it; one in fault has stopped by itself."""
    if goal is Goal.QUICK_STOP:
        return node.state in (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT)
    return node.state not in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, None)


def _listed(faults: Sequence[Fault]) -> str:
    return "; ".join(str(fault) for fault in faults)
