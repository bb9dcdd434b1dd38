"""One emulated servo: control table, torque, watchdog, errors. Time is passed in; frames are its bus's matter.

Where ROBOTIS' manual leaves something open, the servo does what is worst for a careless master: goals are stale after
power-up, clearing a latched watchdog lets it follow the old goal again, and any instruction on the bus, a read of
another servo's register too, keeps its watchdog content.
"""

import random
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from tauscope_sim.dynamixel_bus import control_memory
from tauscope_sim.emulation.fault_kit import FaultKind

CURRENT_MODE, POSITION_MODE, EXTENDED_MODE, CURRENT_BASED_MODE = 0, 3, 4, 5


@dataclass(frozen=True)
class Demand:
    """What a servo wants of its joint until its loop runs again."""

    tracks: bool
    position: float = 0.0  # target [rad or m]
    torque: float = 0.0  # where it does not track [Nm or N]
    cap: float = 0.0  # most that it exerts [Nm or N]


RELEASED = Demand(tracks=False)  # no torque


class ServoLoop:
    """Goals to demands: a target that moves no faster than Profile Velocity, or plain current."""

    def __init__(self, specification: control_memory.ServoSpecification, memory: control_memory.ControlMemory) -> None:
        self._specification = specification
        self._memory = memory
        self._target: float | None = None
        self._held: float | None = None

    def release(self) -> None:
        """Forget target and place: torque went off, or comes on now."""
        self._target = self._held = None

    def hold(self, position: float) -> None:
        """Stop here until `release` or `resume`. `position`: where it stands [rad or m]."""
        self._held = position

    def resume(self) -> None:
        """Follow the goals again, whatever they are by now."""
        self._held = None

    def demand(self, position: float, duration_s: float) -> Demand:
        """What the servo wants now. `position`: as the encoder sees it [rad or m]; `duration_s`: since the last [s]."""
        memory, unit = self._memory, abs(self._specification.torque_per_unit)
        limit = memory.get("Current Limit")
        if memory.get("Operating Mode") in (POSITION_MODE, EXTENDED_MODE, CURRENT_BASED_MODE):
            target = self._move_target(position, duration_s)
            return Demand(tracks=True, position=target, cap=min(limit, self._position_cap()) * unit)
        goal = 0 if self._held is not None else memory.get("Goal Current")
        current = max(-limit, min(limit, goal))
        return Demand(tracks=False, torque=current * self._specification.torque_per_unit, cap=limit * unit)

    def _position_cap(self) -> int:
        memory = self._memory
        if memory.get("Goal PWM") == 0:
            return 0
        if memory.get("Operating Mode") == CURRENT_BASED_MODE or self._specification.figures.goal_current_caps_position:
            return abs(memory.get("Goal Current"))
        return memory.get("Current Limit")

    def _move_target(self, position: float, duration_s: float) -> float:
        """The goal, approached no faster than Profile Velocity allows (0: at once)."""
        if self._held is not None:
            self._target = None
            return self._held
        counts = self._memory.get("Goal Position") - self._specification.figures.zero_count
        goal = counts / self._specification.counts_per_radian
        unit = self._specification.figures.velocity_unit / self._specification.reduction
        most = self._memory.get("Profile Velocity") * unit * duration_s
        target = position if self._target is None else self._target
        self._target = target + max(-most, min(most, goal - target)) if most else goal
        return self._target


OVERHEATING, ENCODER, ELECTRICAL, OVERLOAD = 0x04, 0x08, 0x10, 0x20
ALERT = 0x80

_WATCHDOG_STEP_S = 0.02
_LONGEST_WATCHDOG = 127
_LARGEST_SECONDARY = 252
_TORQUE_ON_BY_GOAL = 0x08
_Y_CODES = {OVERHEATING: 4, ENCODER: 13, ELECTRICAL: 7, OVERLOAD: 5}
_Y_WATCHDOG_CODE = 18
_Y_LASTING = (7, 9, 10, 11, 12, 13, 14, 15)
_ERROR_TO_CLEAR = bytes.fromhex("02 45 52 43 4C")
_TICKS = 32_768
# measurements are means of as many periods of the servo's loop: goals that come in steps make current ripple
_FILTERED_STEPS = 5


class EmulatedServo:
    """A servo on the bus and at its joint."""

    alarms: ClassVar[Mapping[FaultKind, int]] = {
        FaultKind.OVER_TEMPERATURE: OVERHEATING,
        FaultKind.OVERLOAD: OVERLOAD,
        FaultKind.ENCODER_JUMP: ENCODER,
    }

    def __init__(self, specification: control_memory.ServoSpecification, *, seed: int = 0) -> None:
        self.specification, self.servo = specification, specification.servo
        self.memory = control_memory.ControlMemory(specification)
        self.encoder_offset_counts = 0
        self._loop = ServoLoop(specification, self.memory)
        self._random = random.Random(seed)  # noqa: S311 (noise, not a secret)
        self._registered: tuple[int, bytes] | None = None
        self.latched_s: float | None = None
        self._heard_s = 0.0
        self._motion: tuple[float, float] | None = None
        self._seen: deque[tuple[float, float, float]] = deque(maxlen=_FILTERED_STEPS + 1)

    @property
    def secondary(self) -> int | None:
        """Another ID whose writes it carries out, without an answer; None where it has none."""
        number = self.memory.get("Secondary(Shadow) ID") or self.memory.get("Secondary ID")
        return number if 0 < number <= _LARGEST_SECONDARY else None

    @property
    def has_torque(self) -> bool:
        """Whether it drives or holds its joint."""
        return bool(self.memory.get("Torque Enable"))

    @property
    def is_commanded(self) -> bool:
        """Whether it follows a host that it watches over."""
        return self.has_torque and 1 <= self.memory.get("Bus Watchdog") <= _LONGEST_WATCHDOG

    @property
    def error_byte(self) -> int:
        """Alert bit for the status packet."""
        return ALERT if self.hardware_error else 0

    @property
    def hardware_error(self) -> int:
        """Hardware Error Status, or Error Code on Y."""
        return self.memory.get("Hardware Error Status") or self.memory.get("Error Code")

    @property
    def return_delay_s(self) -> float:
        """Return Delay Time [s]."""
        return self.memory.get("Return Delay Time") * 2e-6

    def hear(self, now_s: float) -> None:
        """An instruction went over the bus: the watchdog begins anew."""
        self._heard_s = now_s

    def write(self, address: int, data: bytes) -> None:
        """Write to the control table and do what that means. Raises WriteRefusedError where it is not taken."""
        memory, had_torque, was_latched = self.memory, self.has_torque, self.memory.is_latched
        written = memory.write(address, data)
        goal_wakes = memory.get("Drive Mode") & _TORQUE_ON_BY_GOAL and any(
            name in control_memory.GOALS for name in written
        )
        if goal_wakes and not had_torque:
            memory.put("Torque Enable", 1)
        if self.has_torque and not had_torque:
            if self._is_shut_down:
                memory.put("Torque Enable", 0)
                raise control_memory.WriteRefusedError(control_memory.RESULT_FAIL)
            self._loop.release()
        if was_latched and not memory.is_latched:
            self._loop.resume()
            if memory.get("Error Code") == _Y_WATCHDOG_CODE:
                memory.put("Error Code", 0)

    def register(self, address: int, data: bytes) -> None:
        """Keep a write for the instruction Action."""
        self._registered = (address, data)
        self.memory.put("Registered Instruction", 1)

    def act(self) -> None:
        """Carry out the write that was kept. Raises WriteRefusedError where none was kept, or it is refused."""
        if self._registered is None:
            raise control_memory.WriteRefusedError(2)
        registered, self._registered = self._registered, None
        self.memory.put("Registered Instruction", 0)
        self.write(*registered)

    def clear(self, what: bytes) -> None:
        """Carry out Clear: an error of the Y series whose cause is gone. Raises WriteRefusedError where it stays."""
        code = self.memory.get("Error Code")
        is_hot = self.memory.get("Present Motor Temperature") > self.memory.get("Motor Temperature Limit")
        if "Error Code" not in self.memory or what != _ERROR_TO_CLEAR or code in _Y_LASTING or (code == 4 and is_hot):
            raise control_memory.WriteRefusedError(control_memory.RESULT_FAIL)
        if code == _Y_WATCHDOG_CODE:
            self.memory.put("Bus Watchdog", 0)
            self._loop.resume()
        self.memory.put("Error Code", 0)

    def restart(self) -> None:
        """Reboot, or come back after a power dip: no torque, no watchdog, stale goals, errors forgotten."""
        self.memory.restart()
        self._registered = None
        self._loop.release()

    def fail(self, error: int) -> None:
        """Find a hardware error; the servo lets go where Shutdown says so."""
        if "Error Code" in self.memory:
            self.memory.put("Error Code", _Y_CODES[error])
        self.memory.put("Hardware Error Status", self.memory.get("Hardware Error Status") | error)
        if error == OVERHEATING:
            for name in ("Present Temperature", "Present Motor Temperature"):
                self.memory.put(name, 95)
        if self._is_shut_down:
            self.memory.put("Torque Enable", 0)
            self._loop.release()

    def demand(self, position: float, now_s: float, duration_s: float) -> Demand:
        """What the servo wants for the next stretch. `position`: [rad or m]; `duration_s`: since the last call [s]."""
        if not self.has_torque:
            self._heard_s = now_s
            return RELEASED
        # A jump of the encoder is seen by the loop as a jump of the joint.
        jump = self.encoder_offset_counts / self.specification.counts_per_radian
        self._watch(position + jump, now_s)
        demand = self._loop.demand(position + jump, duration_s)
        return replace(demand, position=demand.position - jump) if jump else demand

    def take_motion(self, position: float, velocity: float, torque: float) -> None:
        """See the joint, and the servo's torque on it. [rad or m], [rad/s or m/s], [Nm or N]."""
        # Torque is that of the period that ends here; position and velocity are taken at its middle too.
        before, speed_before = self._motion or (position, velocity)
        current = torque / self.specification.torque_per_unit
        self._seen.append((0.5 * (before + position), 0.5 * (speed_before + velocity), current))
        self._motion = (position, velocity)

    def sense(self, now_s: float, part: float = 1.0) -> None:
        """Show the present measurement in the control table: position, velocity and current of one instant."""
        older, newer = self._means(0), self._means(1)
        position, velocity, current = ((1.0 - part) * old + part * new for old, new in zip(older, newer, strict=True))
        figures = self.specification.figures
        counts = round(position * self.specification.counts_per_radian) + figures.zero_count
        horn_speed = velocity * self.specification.direction * self.specification.reduction
        noise = self._random.gauss(0.0, self.specification.current_noise_ma / figures.milliampere) if current else 0.0
        self.memory.put("Present Position", counts + self.encoder_offset_counts)
        self.memory.put("Present Velocity", round(horn_speed / figures.velocity_unit))
        self.memory.put("Present Current", round(current + noise))
        self.memory.put("Realtime Tick", int(now_s * 1e3) % _TICKS)

    def _means(self, first: int) -> tuple[float, ...]:
        """Means of what was seen in as many periods, without the first of them or without the last."""
        seen = list(self._seen)
        chosen = seen[first : first + _FILTERED_STEPS] or seen
        return tuple(sum(one) / len(chosen) for one in zip(*chosen, strict=True))

    @property
    def _is_shut_down(self) -> bool:
        if "Error Code" in self.memory:
            return self.memory.get("Error Code") not in (0, _Y_WATCHDOG_CODE)
        return bool(self.memory.get("Hardware Error Status") & self.memory.get("Shutdown"))

    def _watch(self, position: float, now_s: float) -> None:
        """Stop where nothing was heard for the watchdog's time."""
        steps = self.memory.get("Bus Watchdog")
        if 1 <= steps <= _LONGEST_WATCHDOG and now_s - self._heard_s > steps * _WATCHDOG_STEP_S:
            self.latched_s = now_s
            self.memory.put("Bus Watchdog", -1)
            self.memory.put("Error Code", _Y_WATCHDOG_CODE)
            self._loop.hold(position)
