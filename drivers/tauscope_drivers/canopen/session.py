"""The drives of an arm on an open bus, and the ways to ask them: in a cycle of process data, or by SDO."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import NMT_PRE_OPERATIONAL, SYNC_ID, CanBus
from tauscope_drivers.canopen.configuration import BusConfiguration
from tauscope_drivers.canopen.emergency import WATCHDOG_CODE
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.process_data import MEASURED_WHERE_THERE, PdoSlots, plan_pdos
from tauscope_drivers.canopen.state_machine import POWERED, DriveState, Goal, decode_state
from tauscope_drivers.clock import AnswerTime, Clock
from tauscope_drivers.errors import Fault
from tauscope_drivers.state import ArmState, Array, Setpoint


def arm_faults(nodes: Sequence[DriveNode], caught: Fault | None) -> tuple[Fault, ...]:
    """What drives report and what the driver itself has caught; a host that fell silent is one fault of the arm."""
    reported = [fault for node in nodes for fault in node.faults()]
    silence = [replace(fault, joint=None) for fault in reported if fault.code == WATCHDOG_CODE]
    own = [] if caught is None else [caught]
    return (*own, *silence[:1], *(fault for fault in reported if fault.code != WATCHDOG_CODE))


def listed(faults: Sequence[Fault]) -> str:
    """Faults in one line, for messages."""
    return "; ".join(str(fault) for fault in faults)


BRAKING_S = 0.1  # time in which a joint is brought to rest by targets, as fast as it may come to its speed limit [s]


class HostBrake:
    """Brings joints to rest by targets, with constant deceleration."""

    def __init__(self, position: Array, velocity: Array, begin_ns: int) -> None:
        """Begin at a motion. `position`: (n,) [rad or m]; `velocity`: (n,) [rad/s or m/s]; `begin_ns`: now [ns]."""
        self._position, self._velocity, self._begin_ns = position, velocity, begin_ns

    def targets(self, now_ns: int) -> Array:
        """Q + q̇ (t - t²/2T), until t = T, shape (n,) [rad or m]."""
        time_s = min(max(0.0, (now_ns - self._begin_ns) * 1e-9), BRAKING_S)
        return self._position + self._velocity * (time_s - time_s**2 / (2.0 * BRAKING_S))

    def is_at_rest(self, now_ns: int) -> bool:
        """Whether the last target is sent from now on."""
        return (now_ns - self._begin_ns) * 1e-9 >= BRAKING_S


_PLAN = plan_pdos(PdoSlots(), objects.TARGET_POSITION, MEASURED_WHERE_THERE)
# payloads of a drive that has everything and whose PDOs are free [bytes]
CYCLE_FRAMES = tuple(pdo.layout.size for pdo in (*_PLAN.received, *_PLAN.sent))
# cycle while drives change state, before and after the control loop's own, where that is not known
SETTLING_CYCLE_S = 0.01


def cycle_load(configuration: BusConfiguration) -> tuple[int, Sequence[int], float, float | None]:
    """Nodes, payloads of each, bit rate and serial line: the arguments of `largest_rate_hz` and `rate_limit`."""
    return len(configuration.nodes), CYCLE_FRAMES, configuration.bit_rate, configuration.serial_baud


@dataclass
class Session:
    """An arm's drives, reached. `settling_ns`: cycle while drives change state; the control loop's once known [ns]."""

    bus: CanBus
    nodes: tuple[DriveNode, ...]
    clock: Clock
    answer_ns: int  # time that drives get to answer SYNC in the control loop [ns]
    caught: Fault | None = None
    settling_ns: int = round(SETTLING_CYCLE_S * 1e9)
    answer_time: AnswerTime = field(default_factory=AnswerTime)
    brake: HostBrake | None = None

    @property
    def unhurried_ns(self) -> int:
        """Time for an answer while drives change state: no motion waits for the next cycle [ns]."""
        return max(self.answer_ns, self.settling_ns)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What is wrong with the arm."""
        return arm_faults(self.nodes, self.caught)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the drives do not have, and the substitute; drives that agree share a line."""
        places: dict[str, list[str]] = {}
        for node in self.nodes:
            for remark in node.remarks:
                places.setdefault(remark, []).append(str(node.joint))
        return tuple(f"joint {', '.join(joints)}: {remark}" for remark, joints in places.items())

    def make_pre_operational(self) -> None:
        """Take nodes out of process data, but for those that hold their joint by it: they would let go."""
        states = [decode_state(node.dictionary.read(objects.STATUSWORD)) for node in self.nodes]
        if DriveState.OPERATION_ENABLED not in states:
            self.bus.command_nodes(NMT_PRE_OPERATIONAL)
            return
        for node, state in zip(self.nodes, states, strict=True):
            if state is not DriveState.OPERATION_ENABLED:
                self.bus.command_nodes(NMT_PRE_OPERATIONAL, node.configuration.node_id)

    def stop_targets(self) -> Setpoint:
        """Targets of a stop: they bring drives to rest that stop by targets; others do not follow them."""
        now_ns = self.clock.now_ns()
        if self.brake is None:
            speed = np.array([node.last_velocity for node in self.nodes])
            self.brake = HostBrake(self.standstill().position, speed, now_ns)
        return stay_at(self.brake.targets(now_ns))

    def standstill(self) -> Setpoint:
        """Targets where the joints are, by the last answer of each."""
        return stay_at(np.array([node.last_position for node in self.nodes]))

    def cycle(self, mode: ControlMode, goal: Goal, setpoint: Setpoint, answer_ns: int) -> ArmState:
        """One cycle on the bus: targets out, SYNC, answers in."""
        pairs = zip(self.nodes, setpoint.position, setpoint.torque, strict=True)
        told = [node.targets(mode, node.controlword(goal), float(q), float(tau)) for node, q, tau in pairs]
        frames = [frame for frames in told for frame in frames]
        self.bus.drain()
        for node in self.nodes:
            node.values = {}
        self.bus.send_together([*frames, (SYNC_ID, b"")])
        stamp, deadline = self.clock.now_ns(), time.monotonic_ns() + answer_ns
        answered = stamp
        waiting = deque(self.nodes)
        while waiting:
            if waiting[0].has_answered:
                waiting.popleft()
            elif self.bus.receive(deadline):
                answered = self.clock.now_ns()
            elif time.monotonic_ns() >= deadline:
                break
        self.bus.beat()
        return replace(self.observe(stamp), late_ns=self.answer_time.late_ns(answered - stamp))

    def read_by_sdo(self) -> ArmState:
        """The arm as it stands, outside the cycle."""
        for node in self.nodes:
            node.read_now()
        return self.observe(self.clock.now_ns())

    def observe(self, time_ns: int) -> ArmState:
        """The arm by what its drives sent since they were asked, in joint units; NaN where one did not answer."""
        for node in self.nodes:
            node.remember(time_ns)
        position, velocity, effort = np.array([node.measurement for node in self.nodes]).T
        return ArmState(
            time_ns=time_ns,
            position=position,
            velocity=velocity,
            effort=effort,
            temperature=np.full(len(self.nodes), math.nan),
            # of a node that did not answer, as it last told: whether it is missed is what NaN says
            enabled=np.array([node.last_state in POWERED for node in self.nodes]),
            faults=self.faults,
        )

    def step_until(self, is_reached: Callable[[], bool], step: Callable[[], ArmState], within_s: float) -> ArmState:
        """Go on stepping until something is reached or the time for it has passed; the last state."""
        deadline = self.clock.now_ns() + round(within_s * 1e9)
        state = step()
        while not is_reached() and self.clock.now_ns() < deadline:
            self.wait_for_next(state)
            state = step()
        return state

    def wait_for_next(self, state: ArmState) -> None:
        """Let a cycle pass while drives change state."""
        self.clock.wait_until_ns(state.time_ns + self.settling_ns)


def stay_at(place: Array) -> Setpoint:
    """Targets that neither move a joint nor push it. `place`: (n,), where the joints are [rad or m]."""
    return Setpoint(place, np.zeros(len(place)))
