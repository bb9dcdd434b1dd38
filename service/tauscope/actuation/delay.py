"""Delay from a recorded command to its torque, estimated where nothing states it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from tauscope.actuation.smooth_motion import LONGEST_S, SmoothMotion
from tauscope.dynamics import base_parameters, torque_regressor
from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, Samples
from tauscope.robot import Robot

STEP_S = 2e-3  # step of the search [s]; a parabola refines it
FOUND_STD_S = 0.02  # standard error above which a joint takes the delay of the others [s]
SEEN = 3.0  # standard errors above which a delay is taken: a loop in step with its log has none


@dataclass(frozen=True)
class Delay:
    """Delay of one joint's command."""

    value: float  # [s]
    std: float | None = None  # standard error [s]; None where it is stated


def shift_command(time: Array, command: Array, delay: float, rate_hz: float | None, at: Array) -> Array:
    """`command`, (N,), at `at`, (M,), late by a delay, held between updates at `rate_hz` or rows; `time`: (N,) [s]."""
    since = at if rate_hz is None else time[0] + np.floor((at - time[0]) * rate_hz + 1e-9) / rate_hz
    known = np.isfinite(command)
    return np.interp(since - delay, time[known], command[known])


def command_torque(robot: Robot, samples: Samples, delays: Sequence[float]) -> Array:
    """Torque that the loops of all joints make, (N, n) [Nm or N]. `delays`: one a joint [s]."""
    torque = np.full(samples.position.shape, np.nan)
    for joint, delay in enumerate(delays):
        torque[:, joint] = joint_torque(robot, samples, joint, delay)
    return torque


def joint_torque(robot: Robot, samples: Samples, joint: int, delay: float) -> Array:
    """Torque of one joint's loop, (N,)."""
    loop = robot.joints[joint].actuator
    time, position = samples.time, samples.position[:, joint]
    if loop is None or not loop.has_loop or not np.isfinite(samples.effort[:, joint]).any():
        return np.full(len(time), np.nan)
    velocity = np.gradient(position, time) if samples.velocity is None else samples.velocity[:, joint]
    command = shift_command(time, samples.effort[:, joint], delay, loop.rate_hz, time)
    error = command - position if loop.kind == "position" else np.gradient(command, time) - velocity
    known = [None if each is None else each[:, joint] for each in (samples.voltage, samples.gain, samples.temperature)]
    return np.asarray(loop.torque(error, velocity, *known))


def estimate_delays(robot: Robot, recordings: Sequence[Recording]) -> tuple[Delay, ...]:
    """Delays of all joints: stated, or of least unexplained torque; one that tells nothing takes the others' median."""
    loops = robot.actuators
    open_ = [joint for joint, loop in enumerate(loops) if loop is not None and loop.delay is None]
    found: dict[int, Delay] = {}
    if open_:
        grid = np.arange(0.0, LONGEST_S + STEP_S / 2, STEP_S)
        left, rows = np.zeros((len(open_), len(grid))), 0.0
        for recording in recordings:
            squares, count = _sum_residual_squares(robot, recording, open_, grid)
            left, rows = left + squares, rows + count
        found = {joint: _least(grid, squares, rows) for joint, squares in zip(open_, left, strict=True)}
    sure = [each.value for each in found.values() if each.std is not None and each.std < FOUND_STD_S]
    common = Delay(float(np.median(sure)) if sure else 0.0, LONGEST_S)
    return tuple(
        Delay(loop.delay or 0.0)
        if loop is None or joint not in found
        else found[joint]
        if (found[joint].std or 0.0) < FOUND_STD_S
        else common
        for joint, loop in enumerate(loops)
        if loop is not None
    )


def _least(grid: Array, squares: Array, rows: float) -> Delay:
    """Minimum of the unexplained squares by a parabola, and its standard error."""
    place = int(np.argmin(squares))
    if place == len(grid) - 1 or not squares[place] > 0.0:
        return Delay(float(grid[place]), LONGEST_S)
    middle = max(place, 1)
    before, at, after = squares[middle - 1 : middle + 2]
    curvature = (before - 2.0 * at + after) / STEP_S**2
    if curvature <= 0.0:
        return Delay(float(grid[place]), LONGEST_S)
    value = grid[middle] + 0.5 * STEP_S * (before - after) / (before - 2.0 * at + after)
    std = float(np.sqrt(2.0 * squares[place] / max(rows, 1.0) / curvature))
    return Delay(min(float(value), LONGEST_S) if value > SEEN * std else 0.0, std)


def _sum_residual_squares(
    robot: Robot, recording: Recording, joints: Sequence[int], grid: Array
) -> tuple[Array, float]:
    """Squares of torque that bodies and friction leave, (joints, delays), and independent rows behind them."""
    motion = SmoothMotion.of(recording)
    columns = np.asarray(base_parameters(robot).independent_columns)
    regressor = torque_regressor(robot, motion.position, motion.velocity, motion.acceleration, columns=columns)
    left, rows = np.zeros((len(joints), len(grid))), 0
    for place, joint in enumerate(joints):
        moves = motion.moves(joint)
        model = motion.reduce(np.hstack([regressor[:, joint], motion.acceleration[:, [joint]]]), joint)
        if len(model) <= model.shape[1]:
            continue
        made = [motion.onto(joint_torque(robot, motion.samples, joint, float(delay))) for delay in grid]
        target = smooth(np.stack(made, axis=1), motion.rate, motion.band)[moves]
        basis, triangle, _ = qr(model, mode="economic", pivoting=True)
        size = np.abs(np.diag(triangle))
        basis = basis[:, size > 1e-9 * size[0]]
        left[place] = np.sum((target - basis @ (basis.T @ target)) ** 2, axis=0)
        rows = max(rows, len(model))
    return left, rows * motion.independent
