"""Slow reversals of every joint: the motion that shows stiction, Stribeck friction and presliding.

At each of a few postures all joints swing to and fro with speeds that grow and fall:

    q̇ = V/2 (cos l ω t - cos (l + 1) ω t) = V sin(ω t / 2) sin((2 l + 1) ω t / 2),

2 l + 1 passages through zero at different accelerations, from rest to rest. Neighbouring joints have different l, so
that no two reverse together throughout. From posture to posture the arm moves straight where nothing forbids it, else
along the excitation's own path, which is known to be free.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tauscope.excitation.constraints import StateUsage
from tauscope.robot import JointType, Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import FourierSeries
from tauscope.trajectory.limits import MotionLimits
from tauscope.trajectory.segments import FourierSegment, MoveSegment, PathSegment, Segment
from tauscope.trajectory.trajectory import ramp, whole_steps

SPEED_SHARE = 0.05  # peak speed as part of the speed limit
# Peak speed however fast the joint may move [rad/s or m/s].
LARGEST_SPEED = {JointType.REVOLUTE: 0.1, JointType.PRISMATIC: 0.02}
LEVELS = (1.0, 0.5, 0.25)  # peak speeds of successive postures, relative to the first
DURATION_S = 8.0  # time at one posture [s]
LOWEST_ORDERS = (2, 3, 4)  # l of successive joints: five, seven and nine reversals
PLACES = 60  # instants of the excitation's period that are considered as postures
ROOMY = 0.5  # part of its peak speed that every joint has to reach at a posture: near a position limit there is no room
SAME_POSTURE = 1e-12  # postures closer than this need no move [rad or m]
MOVE_FRACTION = 0.6  # part of the limits that moves between postures use
PATH_PACE = 1.0  # largest pace along the excitation's path, in its own time
LONGER = 1.25  # factor by which a move is slowed down until it keeps all limits
MOST_SLOWDOWNS = 12

STEP_S = 0.02  # instants at which moves are checked are this far apart [s]


@dataclass(frozen=True, eq=False)
class SlowPart:
    """What follows the repeated periods and leads back to their start."""

    segments: tuple[Segment, ...]
    postures: int


def slow_part(robot: Robot, series: FourierSeries, limits: MotionLimits, states: StateUsage, count: int) -> SlowPart:
    """Slow reversals at postures of the excitation that lie far apart, and the moves between them."""
    instants = np.arange(float(PLACES)) * (series.period_s / PLACES)
    postures = series.evaluate(instants).position
    swings = [_swing(robot, posture, limits, 1.0) for posture in postures]
    most = _size(_swing(robot, limits.middle, limits, 1.0))
    roomy = [place for place in range(PLACES) if (_size(swings[place]) >= ROOMY * most).all()]
    admissible = [place for place in roomy if _is_free(swings[place], limits, states)]
    chosen = sorted(_far_apart(postures / limits.half_range, admissible, count))
    segments: list[FourierSegment | MoveSegment | PathSegment] = []
    here = 0.0
    for level, place in enumerate(chosen):
        segments += _transfer(series, here, instants[place], limits, states)
        segments.append(_swing(robot, postures[place], limits, LEVELS[level % len(LEVELS)]))
        here = float(instants[place])
    if chosen:
        segments += _transfer(series, here, series.period_s, limits, states)
    if not all(_is_free(segment, limits, states) for segment in segments):
        return SlowPart((), 0)
    return SlowPart(tuple(segments), len(chosen))


def _swing(robot: Robot, posture: Array, limits: MotionLimits, level: float) -> FourierSegment:
    """Slow reversals of all joints about a posture, as large as their room allows."""
    harmonics = max(LOWEST_ORDERS) + 1
    cosine = np.zeros((robot.joint_count, harmonics))
    omega = 2.0 * np.pi / DURATION_S
    for j, joint in enumerate(robot.joints):
        order = LOWEST_ORDERS[j % len(LOWEST_ORDERS)]
        speed = level * min(SPEED_SHARE * limits.velocity[j], LARGEST_SPEED[joint.type])
        reach = 0.5 * speed * (1.0 / order + 1.0 / (order + 1)) / omega
        bend = speed * omega * (order + 1)
        room = min(posture[j] - limits.position_low[j], limits.position_high[j] - posture[j])
        speed *= min(1.0, max(room, 0.0) / reach, limits.acceleration[j] / bend)
        cosine[j, order - 1], cosine[j, order] = 0.5 * speed, -0.5 * speed
    return FourierSegment(FourierSeries(DURATION_S, posture, cosine, np.zeros_like(cosine)))


def _size(swing: FourierSegment) -> Array:
    return np.abs(swing.series.cosine).max(axis=1)


def _far_apart(places: Array, admissible: list[int], count: int) -> list[int]:
    if not admissible or count < 1:
        return []
    distance = np.linalg.norm(places[admissible] - places[admissible].mean(axis=0), axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(admissible))):
        chosen.append(admissible[int(np.argmax(distance))])
        nearest = np.linalg.norm(places[admissible] - places[chosen[-1]], axis=1)
        distance = nearest if len(chosen) == 1 else np.minimum(distance, nearest)
    return list(dict.fromkeys(chosen))


def _transfer(
    series: FourierSeries, from_s: float, to_s: float, limits: MotionLimits, states: StateUsage
) -> Iterator[MoveSegment | PathSegment]:
    """The move between two postures of the excitation: straight, or along its path."""
    ends = series.evaluate(np.array([from_s, to_s])).position
    if np.abs(ends[1] - ends[0]).max() < SAME_POSTURE:
        return
    straight = ramp(ends[0], ends[1], limits, fraction=MOVE_FRACTION)
    if _is_free(straight, limits, states):
        yield straight
        return
    # The shorter way round the closed path.
    there = to_s - from_s
    way = there - series.period_s * np.rint(there / series.period_s) if abs(there) < series.period_s else 0.0
    duration = whole_steps(1.875 * abs(way) / PATH_PACE)
    segment = PathSegment(series, from_s, from_s + float(way), duration)
    for _ in range(MOST_SLOWDOWNS):
        if _is_free(segment, limits, states):
            break
        segment = PathSegment(series, from_s, segment.to_s, whole_steps(LONGER * segment.duration_s))
    yield segment


def _is_free(segment: FourierSegment | MoveSegment | PathSegment, limits: MotionLimits, states: StateUsage) -> bool:
    count = max(int(np.ceil(segment.duration_s / STEP_S)), 2)
    motion = segment.evaluate(np.linspace(0.0, segment.duration_s, count + 1))
    kinematic = max(np.abs(part).max() for part in limits.usage(motion))
    return bool(kinematic <= 1.0 + 1e-9 and states.largest(motion) <= 1.0)
