"""Real recordings with one thing changed whose size is known: later torque, another gain, torque that is added."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.real.concealing.passage import with_effort
from tauscope.recording import Recording
from tauscope.robot import Model, Robot
from tauscope.robot.robot import LinkInertia
from tauscope_sim.effects.carried_bodies import Payload
from tauscope_sim.model import build_model
from tauscope_sim.recording import rigid_body_torque

Array = NDArray[np.float64]
Edit = Callable[[Robot, Recording], Recording]
"""From the arm and a recording to the same with something concealed."""

MOTION_HZ = 15.0
"""Band in which the motion is differentiated, for torque that is added to it."""

COGGING_ORDERS = (7, 28, 14, 12)
"""Largest orders of the recorded cogging map, per turn."""


def later(samples: int, joint: int | None = None) -> Edit:
    """The torque of a joint, or of all, so many samples later than the positions; the first ones are left out."""

    def edit(robot: Robot, recording: Recording) -> Recording:
        effort = recording.samples().effort.copy()
        columns = slice(None) if joint is None else joint
        effort[samples:, columns] = effort[:-samples, columns].copy()
        return with_effort(recording, effort, slice(samples, None))

    return edit


def scaled(joint: int, gain: float) -> Edit:
    """A torque channel multiplied."""

    def edit(robot: Robot, recording: Recording) -> Recording:
        effort = recording.samples().effort.copy()
        effort[:, joint] *= gain
        return with_effort(recording, effort)

    return edit


def carried(mass: float, place: tuple[float, float, float], from_share: float = 0.0) -> Edit:
    """A point mass on the last link, from a part of the recording's time on."""

    def edit(robot: Robot, recording: Recording) -> Recording:
        told = recording.samples()
        torque = point_mass_torque(robot, recording, mass, place)
        span = told.time[-1] - told.time[0]
        torque[told.time < told.time[0] + from_share * span] = 0.0
        return with_effort(recording, told.effort + torque)

    return edit


def cogging_of(source: Recording, joint: int, rms: float) -> Edit:
    """The cogging map of another machine's recording, at a joint's angle and with a wanted rms [Nm]."""
    angle, current = source.samples().position[:, 0], source.samples().effort[:, 0]
    waves = np.outer(angle, COGGING_ORDERS)
    columns = np.column_stack([np.ones(len(angle)), np.cos(waves), np.sin(waves)])
    fitted, *_ = np.linalg.lstsq(columns, current, rcond=None)
    count = len(COGGING_ORDERS)
    cosines, sines = fitted[1 : 1 + count], fitted[1 + count :]
    size = rms / np.sqrt(0.5 * float(np.sum(cosines**2 + sines**2)))

    def edit(robot: Robot, recording: Recording) -> Recording:
        told = recording.samples()
        phases = np.outer(told.position[:, joint], COGGING_ORDERS)
        effort = told.effort.copy()
        effort[:, joint] += size * (np.cos(phases) @ cosines + np.sin(phases) @ sines)
        return with_effort(recording, effort)

    return edit


def point_mass_torque(robot: Robot, recording: Recording, mass: float, place: tuple[float, float, float]) -> Array:
    """Torque (N, n) of a point mass along a recorded motion, by MuJoCo: an arm with it, less the same arm without."""
    link = LinkInertia(1.0, np.zeros(3), 0.1 * np.eye(3))
    bare = replace(robot, model=Model((link,) * robot.joint_count, None))
    loaded = Payload(mass=mass, offset=list(place)).alter(bare)
    position, velocity, acceleration = motion(recording)
    with_mass, without = (
        rigid_body_torque(build_model(each), position, velocity, acceleration) for each in (loaded, bare)
    )
    return with_mass - without


def motion(recording: Recording) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (N, n): filtered without delay, central differences."""
    told = recording.samples()
    step = float(np.median(np.diff(told.time)))
    even = told.time[0] + step * np.arange(int((told.time[-1] - told.time[0]) / step) + 1)
    position = np.column_stack([np.interp(even, told.time, each) for each in told.position.T])
    band = signal.butter(4, MOTION_HZ, fs=1.0 / step, output="sos")
    position = np.asarray(signal.sosfiltfilt(band, position, axis=0))
    velocity = np.gradient(position, step, axis=0)
    acceleration = np.gradient(velocity, step, axis=0)

    def back(values: Array) -> Array:
        return np.column_stack([np.interp(told.time, even, each) for each in values.T])

    return back(position), back(velocity), back(acceleration)
