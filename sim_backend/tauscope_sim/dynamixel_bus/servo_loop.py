"""What an emulated servo wants of its joint, from its goals: torque, or a target to be tracked under a cap."""

from dataclasses import dataclass

from tauscope_sim.dynamixel_bus.control_memory import ControlMemory
from tauscope_sim.dynamixel_bus.specification import ServoSpecification

CURRENT_MODE, POSITION_MODE, EXTENDED_MODE, CURRENT_BASED_MODE = 0, 3, 4, 5


@dataclass(frozen=True)
class Demand:
    """What a servo wants of its joint until its loop runs again.

    `position`: target [rad or m].
    `speed`: of the target [rad/s or m/s].
    `torque`: where it does not track [Nm or N].
    `cap`: most that it exerts [Nm or N].
    """

    tracks: bool
    position: float = 0.0
    speed: float = 0.0
    torque: float = 0.0
    cap: float = 0.0


RELEASED = Demand(tracks=False)
"""No torque."""


class ServoLoop:
    """Goals to demands: a target that moves no faster than Profile Velocity, or plain current."""

    def __init__(self, specification: ServoSpecification, memory: ControlMemory) -> None:
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
        """What the servo wants now.

        `position`: of the joint, as the encoder sees it [rad or m]; `duration_s`: since the last demand [s].
        """
        memory, unit = self._memory, abs(self._specification.torque_per_unit)
        limit = memory.get("Current Limit")
        if memory.get("Operating Mode") in (POSITION_MODE, EXTENDED_MODE, CURRENT_BASED_MODE):
            target, speed = self._move_target(position, duration_s)
            return Demand(tracks=True, position=target, speed=speed, cap=min(limit, self._position_cap()) * unit)
        goal = 0 if self._held is not None else memory.get("Goal Current")
        current = max(-limit, min(limit, goal))
        return Demand(tracks=False, torque=current * self._specification.torque_per_unit, cap=limit * unit)

    def _position_cap(self) -> int:
        """Largest current while positions are tracked."""
        memory = self._memory
        if memory.get("Goal PWM") == 0:
            return 0
        if memory.get("Operating Mode") == CURRENT_BASED_MODE or self._specification.figures.goal_current_caps_position:
            return abs(memory.get("Goal Current"))
        return memory.get("Current Limit")

    def _move_target(self, position: float, duration_s: float) -> tuple[float, float]:
        """Target and its speed: the goal, approached no faster than Profile Velocity allows (0: at once)."""
        if self._held is not None:
            self._target = None
            return self._held, 0.0
        counts = self._memory.get("Goal Position") - self._specification.figures.zero_count
        goal = counts / self._specification.counts_per_radian
        fastest = self._memory.get("Profile Velocity") * self._velocity_unit
        target = position if self._target is None else self._target
        if fastest == 0.0:
            self._target = goal
            return goal, 0.0
        step = max(-fastest * duration_s, min(fastest * duration_s, goal - target))
        self._target = target + step
        return self._target, 0.0

    @property
    def _velocity_unit(self) -> float:
        """Joint speed of one unit of velocity [rad/s or m/s]."""
        return self._specification.figures.velocity_unit / self._specification.reduction
