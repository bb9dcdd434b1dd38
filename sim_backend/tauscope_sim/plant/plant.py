"""The simulated arm as a thing that torque moves: place it, push it, look where it is."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite

import numpy as np
from numpy.typing import ArrayLike

from tauscope.errors import ScenarioError
from tauscope.robot.robot import Array, Robot
from tauscope_sim.plant.equations import EquationsOfMotion
from tauscope_sim.plant.rosenbrock import RosenbrockStep
from tauscope_sim.plant.term import AMBIENT, PhysicalEffect

# the twist shrinks by the ratio of gravity's gradient to stiffness each time; a few rounds are usual
MOST_ITERATIONS = 200
SETTLED = 1e-13  # change of a link's position that ends the iteration [rad or m]


def settled(equations: EquationsOfMotion, motor_position: Array) -> Array:
    """An arm at rest, (2N + m,): q_j = θ_j - twist_j(load_j(q)). Raises ScenarioError. `motor_position`: θ, (n,)."""
    compliant = list(equations.coordinates.compliant)
    position = np.concatenate([motor_position, motor_position[compliant]])
    vector = np.concatenate([position, np.zeros_like(position), equations.initial_states()])
    low, high = np.full(len(compliant), -np.inf), np.full(len(compliant), np.inf)
    change = np.zeros(len(compliant))
    for _ in range(MOST_ITERATIONS if compliant else 0):
        load, place = equations.load_at(0.0, vector.tolist()), vector[compliant]
        hanging = motor_position[compliant] - equations.compliance.twist_at_rest(load)
        low, high = _narrow(low, high, place, hanging)
        # a link that balances inside its backlash wishes itself from tooth to tooth: it is between the two
        between = (hanging <= low) | (hanging >= high)
        following = hanging.copy()
        following[between] = 0.5 * (low[between] + high[between])
        change = following - place
        vector[compliant] = following
        if np.all(np.abs(change) < SETTLED):
            return vector
    if not compliant:
        return vector
    joint = compliant[int(np.argmax(np.abs(change)))] + 1
    raise ScenarioError(f"joint {joint}: its transmission is too soft to carry the arm; give it more stiffness")


def _narrow(low: Array, high: Array, place: Array, hanging: Array) -> tuple[Array, Array]:
    """Bounds of every link's place at rest; one that other links' moves have made wrong is given up."""
    up, down = hanging > place, hanging < place
    low, high = np.where(up, place, low), np.where(down, place, high)
    crossed = low >= high
    return np.where(crossed & down, -np.inf, low), np.where(crossed & up, np.inf, high)


STEP = 5e-4  # longest step of the integration where none is asked for [s]
TOLERANCE = 2e-5  # Error of one step of length `STEP` that is let pass: velocity [rad/s or m/s], internal states [1]
SHORTEST_PART = 2.0**-12  # shortest sub-step, as a part of the step


@dataclass(frozen=True, eq=False)
class PlantState:
    """Where the plant is, in joint units; every array a copy."""

    time: float  # since the arm was placed [s]
    motor_position: Array  # (n,), of the motors, divided by the gear ratio [rad or m]
    motor_velocity: Array  # (n,), likewise [rad/s or m/s]
    link_position: Array  # (n,), q; the motor's own where the transmission is rigid [rad or m]
    link_velocity: Array  # (n,), q̇ [rad/s or m/s]
    temperature: Array  # (n,), of the joints [°C]


class Plant:
    """Forward physics of an arm: rigid bodies, the robot file's static friction, and concealed effects.

    Steps are at most `step_s` [s]. Where friction reverses, teeth meet or a bristle turns, a step is divided until its
    estimated error is below `TOLERANCE` × (step_s / `STEP`)²: the result converges with the square of `step_s`. None
    crosses an instant at which an effect begins or ends. Raises RobotFileError, ScenarioError where robot or effects do
    not fit.
    """

    def __init__(self, robot: Robot, effects: Sequence[PhysicalEffect] = (), *, step_s: float = STEP) -> None:
        if not (isfinite(step_s) and step_s > 0.0):
            raise ScenarioError(f"step_s is {step_s}; give a positive duration")
        self._equations = EquationsOfMotion(robot, effects)
        self._coordinates = self._equations.coordinates
        self.joint_count = robot.joint_count
        self._motors = self._coordinates.motors
        self._step = RosenbrockStep(self._equations)
        self._longest = step_s
        self._tolerance = TOLERANCE * (step_s / STEP) ** 2
        self._shortest = SHORTEST_PART * step_s
        self._part = step_s
        self.place(np.zeros(robot.joint_count))

    @property
    def motor_motion(self) -> tuple[Array, Array]:
        """Position and velocity of the motors, in joint units, each (n,) [rad or m, rad/s or m/s]."""
        return self._number_motors(0), self._number_motors(self._coordinates.size)

    @property
    def state(self) -> PlantState:
        """Where the plant is."""
        count, size = self.joint_count, self._coordinates.size
        return PlantState(
            time=self._time,
            motor_position=self._number_motors(0),
            motor_velocity=self._number_motors(size),
            link_position=np.array(self._vector[:count]),
            link_velocity=np.array(self._vector[size : size + count]),
            temperature=self._equations.temperature(self._vector[2 * size :], AMBIENT),
        )

    def place(self, position: ArrayLike) -> None:
        """Start afresh at rest. Raises ScenarioError: no such place, or too soft. `position`: (n,), of the motors."""
        motors = np.asarray(position, dtype=np.float64)
        if motors.shape != (self.joint_count,) or not np.all(np.isfinite(motors)):
            raise ScenarioError(f"position {motors} is not one finite number for each of {self.joint_count} joints")
        self._time = 0.0
        self._events = [time for time in self._equations.event_times if time > 0.0]
        self._equations.bodies.drop_everything()
        self._equations.begin(0.0)
        self._vector = settled(self._equations, motors).tolist()
        self._part = self._longest

    def advance(self, motor_torque: ArrayLike, duration_s: float) -> None:
        """Let time pass under `motor_torque`, (n,) [Nm or N]. Raises ScenarioError: motion without bounds."""
        if not duration_s >= 0.0:
            raise ScenarioError(f"duration_s is {duration_s}; time passes forwards only")
        drive = np.asarray(motor_torque, dtype=np.float64).tolist()
        end = self._time + duration_s
        while self._events and self._events[0] <= end:
            event = self._events.pop(0)
            self._advance_to(event, drive)
            self._equations.begin(event)
        self._advance_to(end, drive)

    def _advance_to(self, end: float, drive: list[float]) -> None:
        """Integrate over an interval without events, in equal steps unless the error asks for shorter ones."""
        duration = end - self._time
        if duration <= 0.0:
            return
        steps = max(1, ceil(duration / self._longest - 1e-9))
        nominal = duration / steps
        begin = self._time
        for number in range(1, steps + 1):
            self._step_to(begin + nominal * number if number < steps else end, drive)

    def _step_to(self, end: float, drive: list[float]) -> None:
        """Integrate over one step, or over as many parts of it as its error asks for."""
        while self._time < end:
            remaining = end - self._time
            # the last part takes what is left: none is cut to a sliver
            part = remaining if remaining < 1.5 * self._part else self._part
            self._step.begin(self._time, self._vector, drive)
            attempt = self._step.attempt(part, self._tolerance)
            while not attempt.error <= 1.0 and part > self._shortest:
                part = max(part * _change(attempt.error), self._shortest)
                attempt = self._step.attempt(part, self._tolerance)
            if not isfinite(attempt.error):
                raise ScenarioError(
                    f"the simulated arm's motion grows beyond all bounds at {self._time:g} s; drive it with less torque"
                )
            # what is too quick even for the shortest part is not worth following, only its end
            self._vector = attempt.second_order if attempt.error <= 1.0 else attempt.first_order
            self._time = end if part == remaining else self._time + part
            self._part = min(max(part * _change(attempt.error), self._shortest), self._longest)

    def _number_motors(self, first: int) -> Array:
        return np.array([self._vector[first + place] for place in self._motors])


def _change(error: float) -> float:
    """Factor on the step's length by its error: the difference between the orders grows with the square of the step."""
    if not isfinite(error):
        return 0.1
    return min(max(0.9 * error**-0.5, 0.1), 4.0) if error > 0.0 else 4.0
