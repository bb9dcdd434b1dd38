"""The drives of an arm on an open bus, and the ways to ask them: in a cycle of process data, or by SDO."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from statistics import median

import numpy as np

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen.bus import SYNC_ID, CanBus
from tauscope_drivers.canopen.bus_budget import CycleFrames, largest_rate_hz, rate_limit
from tauscope_drivers.canopen.configuration import BusConfiguration
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.observation import arm_faults, arm_state
from tauscope_drivers.canopen.process_data import MOTION_PDO, RECEIVED_ID, STATE_PDO, TARGET_PDOS
from tauscope_drivers.canopen.state_machine import Goal
from tauscope_drivers.clock import Clock
from tauscope_drivers.errors import Fault
from tauscope_drivers.state import ArmState, Array, Setpoint

REMEMBERED = 31
"""Answers by which it is known what is usual: adapters take their time, each its own."""


class AnswerTime:
    """Compares how long each answer took with what is usual on this bus and adapter."""

    def __init__(self) -> None:
        """Nothing is known yet, and nothing is late."""
        self._taken_ns: deque[int] = deque(maxlen=REMEMBERED)

    def late_ns(self, taken_ns: int) -> int:
        """How much later than usual an answer came [ns].

        Parameters
        ----------
        taken_ns : int
            from SYNC to the last frame of the answer [ns]
        """
        self._taken_ns.append(taken_ns)
        return max(0, taken_ns - round(median(self._taken_ns)))


CYCLE_FRAMES = CycleFrames((TARGET_PDOS[ControlMode.POSITION].size,), (STATE_PDO.size, MOTION_PDO.size))

SETTLING_CYCLE_S = 0.01
"""Cycle while drives change state, before and after the control loop's own, where that is not known."""


def possible_rate_hz(configuration: BusConfiguration) -> float:
    """Most cycles a second that bus and adapter carry [Hz]."""
    return largest_rate_hz(len(configuration.nodes), CYCLE_FRAMES, configuration.bit_rate, configuration.serial_baud)


def rate_limited_by(configuration: BusConfiguration) -> str:
    """What keeps the rate from being higher, and what to do about it."""
    return rate_limit(len(configuration.nodes), CYCLE_FRAMES, configuration.bit_rate, configuration.serial_baud)


@dataclass
class Session:
    """An arm's drives, reached.

    answer_ns : int
        time that drives get to answer SYNC in the control loop [ns]
    settling_ns : int
        cycle while drives change state: that of the control loop, once it is known [ns]
    """

    bus: CanBus
    nodes: tuple[DriveNode, ...]
    clock: Clock
    answer_ns: int
    caught: Fault | None = None
    settling_ns: int = round(SETTLING_CYCLE_S * 1e9)
    answer_time: AnswerTime = field(default_factory=AnswerTime)

    @property
    def unhurried_ns(self) -> int:
        """Time for an answer while drives change state: no motion waits for the next cycle [ns]."""
        return max(self.answer_ns, self.settling_ns)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What is wrong with the arm."""
        return arm_faults(self.nodes, self.caught)

    def learn_cycle(self, cycle_s: float | None) -> None:
        """Settle in the control loop's own cycle from now on.

        Parameters
        ----------
        cycle_s : float or None
            of the loop; `SETTLING_CYCLE_S` where it is not known [s]
        """
        self.settling_ns = round((SETTLING_CYCLE_S if cycle_s is None else cycle_s) * 1e9)

    def standstill(self) -> Setpoint:
        """Targets where the joints are, by the last answer of each."""
        return stay_at(np.array([node.last_position for node in self.nodes]))

    def cycle(self, mode: ControlMode, goal: Goal, setpoint: Setpoint, answer_ns: int) -> ArmState:
        """One cycle on the bus: targets out, SYNC, answers in."""
        pairs = zip(self.nodes, setpoint.position, setpoint.torque, strict=True)
        frames = [
            (RECEIVED_ID + node.configuration.node_id, node.target(mode, node.controlword(goal), float(q), float(tau)))
            for node, q, tau in pairs
        ]
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
        """The arm by what its drives sent since they were asked."""
        for node in self.nodes:
            node.remember(time_ns)
        return arm_state(self.nodes, time_ns, self.caught)

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
    """Targets that neither move a joint nor push it.

    Parameters
    ----------
    place : (n,) float64
        where the joints are [rad or m]
    """
    return Setpoint(place, np.zeros(len(place)))
