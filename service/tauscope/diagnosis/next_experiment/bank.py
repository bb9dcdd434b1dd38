"""Motions to choose the next experiment from: Fourier series of several kinds, sweeps, slow reversals.

All keep the arm's limits of position, speed and acceleration, and of torque as far as the identified model predicts it;
where that would allow no posture, as far as the robot file's does.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.excitation import ExcitationOptions
from tauscope.excitation.setting import Setting
from tauscope.excitation.slow_reversals import slow_part
from tauscope.identification import Identification
from tauscope.recording.recording import Array
from tauscope.robot import FrictionCoefficients, Model, Robot
from tauscope.trajectory import FourierSegment, FourierSeries, MotionLimits, MotionSamples, SampledSegment, Trajectory

DURATION_S = 20.0  # of every Fourier series and sweep [s]
WIDE = "a wide motion"
# Period [s] and harmonics of the Fourier series.
KINDS = {"a random motion": (10.0, 5), "a fast motion": (4.0, 4), WIDE: (10.0, 2)}
SWEEP_SHARES = (0.08, 0.3, 0.8)  # speeds of sweeps, as part of the limit
SLOW_POSTURES = 3
WIDEST_OF = 8  # wide motions of which the one that crosses most of the position ranges is taken
CHECKED = 2000  # instants at which a motion's torque and range are looked at
TAKEN_BACK = 0.75  # factor by which a sweep that needs too much torque is slowed down
MOST_TAKEN_BACK = 8
RATE_HZ = 100.0  # samples that define the motion; between them it is a quintic
# Cycles of the first joint; each further one makes one more, so that they reverse at different instants.
LEAST_CYCLES = 2
ACCELERATION_SHARE = 0.8  # part of the acceleration limit that a reversal uses
ROOM_SHARE = 0.9  # part of the position range that a sweep crosses at most
STEEPEST = 1.875  # largest slope of the quintic step of height and length one
LONGEST_TURN = 0.1  # part of a cycle that one quarter of its turning may take


@dataclass(frozen=True, eq=False)
class Primitive:
    """One motion of the bank."""

    kind: str
    trajectory: Trajectory


class Bank:
    """Makes motions for one arm."""

    def __init__(self, identification: Identification, rng: np.random.Generator) -> None:
        self._rng = rng
        try:
            self._prepare(_as_identified(identification))
        except ExcitationError:
            # the arm was in some posture: what was identified of a poor motion is no guide where it allows none
            self._prepare(identification.robot)

    def _prepare(self, robot: Robot) -> None:
        """Constraints and standing postures of an arm as it is believed to be."""
        self._settings = {
            kind: Setting.of(robot, ExcitationOptions(period_s=period, harmonics=harmonics))
            for kind, (period, harmonics) in KINDS.items()
        }
        self._robot = robot
        first = next(iter(self._settings.values()))
        self._limits, self._states = first.planned, first.states
        self._postures = first.feasibility.standing_postures(self._rng)

    def first_look(self, of_each: int) -> Iterator[Primitive]:
        """Some motions of every kind."""
        for kind in KINDS:
            yield from self.fourier(kind, of_each)
        for share in SWEEP_SHARES:
            yield from self._sweep(share)
        yield from self._slow_reversals()

    def everywhere(self, count: int) -> Iterator[Primitive]:
        """Motions through as much of the ranges of positions and speeds as one takes in, slow reversals included."""
        setting = self._settings[WIDE]
        for _ in range(count):
            drawn = (setting.feasibility.random_start(self._postures, self._rng) for _ in range(WIDEST_OF))
            found = [setting.space.series(x) for x in drawn if x is not None]
            if not found:
                continue
            series = max(found, key=self._crossed)
            slow = slow_part(self._robot, series, self._limits, self._states, SLOW_POSTURES).segments
            kind = f"{WIDE} and slow reversals in several postures" if slow else WIDE
            yield Primitive(kind, self._trajectory(_repeated(series), *slow))

    def _crossed(self, series: FourierSeries) -> float:
        """Part of its position range that the joint with the least of it crosses."""
        position = series.evaluate(np.linspace(0.0, series.period_s, CHECKED)).position
        return float((np.ptp(position, axis=0) / (2.0 * self._limits.half_range)).min())

    def fourier(self, kind: str, count: int) -> Iterator[Primitive]:
        """Random Fourier series about random postures."""
        setting = self._settings[kind]
        for _ in range(count):
            x = setting.feasibility.random_start(self._postures, self._rng)
            if x is not None:
                yield Primitive(kind, self._trajectory(_repeated(setting.space.series(x))))

    def _sweep(self, share: float) -> Iterator[Primitive]:
        """Constant speed to and fro, slowed down until its torque is there."""
        for _ in range(MOST_TAKEN_BACK):
            segment = sweep(self._limits, share, DURATION_S)
            motion = segment.evaluate(np.linspace(0.0, segment.duration_s, CHECKED))
            if self._states.largest(motion) <= 1.0:
                yield Primitive(f"sweeps at {100.0 * share:.0f} % of the top speed", self._trajectory(segment))
                return
            share *= TAKEN_BACK

    def _slow_reversals(self) -> Iterator[Primitive]:
        setting = next(iter(self._settings.values()))
        x = setting.feasibility.random_start(self._postures, self._rng)
        if x is None:
            return
        series = setting.space.series(x)
        slow = slow_part(self._robot, series, self._limits, self._states, SLOW_POSTURES)
        if slow.segments:
            yield Primitive("slow reversals in several postures", self._trajectory(*slow.segments))

    def _trajectory(self, *segments: object) -> Trajectory:
        names = tuple(joint.name for joint in self._robot.joints)
        return Trajectory(self._robot.name, names, segments, self._limits)  # pyright: ignore[reportArgumentType]


def _repeated(series: FourierSeries) -> FourierSegment:
    """As many periods as come closest to `DURATION_S`."""
    return FourierSegment(series, max(1, round(DURATION_S / series.period_s)), 0)


def _as_identified(identification: Identification) -> Robot:
    """The arm with the links and the friction that were identified, for the torque that motions need."""
    structure, parameters = identification.structure, identification.consistent_parameters
    friction = []
    for joint in range(identification.robot.joint_count):
        columns = {name: structure.coefficient(joint, name) for name in ("stiction", "stribeck", "viscous")}
        values = {name: 0.0 if at is None else float(parameters[at]) for name, at in columns.items()}
        values["viscous"] = max(values["viscous"], 0.0)
        friction.append(FrictionCoefficients(**values))
    model = Model(tuple(identification.consistent.links), tuple(friction))
    return replace(identification.robot, model=model)


def sweep(limits: MotionLimits, share: float, duration_s: float) -> SampledSegment:
    """All joints at ± a part of their top speed, turning smoothly, from rest to rest where they began."""
    time = np.arange(round(duration_s * RATE_HZ) + 1) / RATE_HZ
    count = len(limits.velocity)
    position, velocity, acceleration = (np.empty((len(time), count)) for _ in range(3))
    for joint in range(count):
        cycle = duration_s / (LEAST_CYCLES + joint)
        speed = share * limits.velocity[joint]
        turn = min(STEEPEST * speed / (ACCELERATION_SHARE * limits.acceleration[joint]), LONGEST_TURN * cycle)
        speed = min(speed, turn * ACCELERATION_SHARE * limits.acceleration[joint] / STEEPEST)
        crossing = 0.5 * cycle - turn  # half a cycle is a quarter turn, a crossing and a quarter turn
        room = ROOM_SHARE * 2.0 * limits.half_range[joint]
        speed = min(speed, room / crossing)
        way, pace, bend = _cycle(np.mod(time, cycle), cycle, turn)
        start = limits.middle[joint] - 0.5 * speed * crossing
        position[:, joint], velocity[:, joint] = start + speed * way, speed * pace
        acceleration[:, joint] = speed * bend
    velocity[[0, -1]], acceleration[[0, -1]] = 0.0, 0.0
    position[-1] = position[0]
    return SampledSegment(time, MotionSamples(position, velocity, acceleration))


def _cycle(time: Array, cycle: float, turn: float) -> tuple[Array, Array, Array]:
    """Way, speed and acceleration of unit speed there and back: rest, +1, through zero to -1, rest; (N,) each."""
    way, pace, bend = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    for begin, length, height in ((0.0, turn, 1.0), (0.5 * cycle - turn, 2.0 * turn, -2.0), (cycle - turn, turn, 1.0)):
        s = np.clip((time - begin) / length, 0.0, 1.0)
        after = np.maximum(time - begin - length, 0.0)
        pace += height * s**3 * (10.0 + s * (6.0 * s - 15.0))
        way += height * (length * s**4 * (2.5 + s * (s - 3.0)) + after)
        bend += height * 30.0 * (s * (1.0 - s)) ** 2 / length
    return way, pace, bend
