"""Sweeps to and fro at constant speed, every joint with a rhythm of its own."""

import numpy as np

from tauscope.recording.recording import Array
from tauscope.trajectory import MotionLimits, MotionSamples, SampledSegment

RATE_HZ = 100.0  # samples that define the motion; between them it is a quintic
# Cycles of the first joint; each further one makes one more, so that they reverse at different instants.
LEAST_CYCLES = 2
ACCELERATION_SHARE = 0.8  # part of the acceleration limit that a reversal uses
ROOM_SHARE = 0.9  # part of the position range that a sweep crosses at most
STEEPEST = 1.875  # largest slope of the quintic step of height and length one
LONGEST_TURN = 0.1  # part of a cycle that one quarter of its turning may take


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
