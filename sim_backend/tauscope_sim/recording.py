"""A recording that a simulated arm would leave: exact motion, exact torque, and what noisy sensors make of them."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tauscope.errors import RecordingError
from tauscope.robot.robot import Array, Joint, Robot
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.motion import FourierMotion, MotionSamples
from tauscope_sim.scenario import quantise


def rigid_body_torque(model: mujoco.MjModel, position: Array, velocity: Array, acceleration: Array) -> Array:
    """Joint torque τ = H(q) q̈ + h(q, q̇) + c(q), (N, n) [Nm or N], along a motion, by ``mj_inverse``: equation (1).

    `position`, `velocity`, `acceleration`: (N, n), q, q̇, q̈ [rad or m, and per s, per s²].
    """
    data = mujoco.MjData(model)
    torque = np.empty_like(position)
    for row in range(len(position)):
        data.qpos[:] = position[row]
        data.qvel[:] = velocity[row]
        data.qacc[:] = acceleration[row]
        mujoco.mj_inverse(model, data)
        torque[row] = data.qfrc_inverse
    return torque


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """A simulated measurement together with the truth behind it."""

    time: Array  # (N,), instants, uniform, from zero [s]
    position: Array  # (N, n), q as the encoder reports it [rad or m]
    torque: Array  # (N, n), τ as measured: exact torque plus noise [Nm or N]
    exact: MotionSamples  # q, q̇, q̈ without noise, (N, n) each
    torque_exact: Array  # (N, n), τ without noise, friction included [Nm or N]
    period: NDArray[np.int64]  # (N,) int64, index of the repeated period, from zero


def simulate_recording(
    robot: Robot,
    motion: FourierMotion,
    *,
    rate_hz: float,
    periods: int,
    noise_std: ArrayLike,
    rng: np.random.Generator,
    position_noise_std: ArrayLike = 0.0,
    encoder_step: ArrayLike = 0.0,
) -> SimulatedRecording:
    """Record an arm that follows a motion exactly: τ = H(q) q̈ + h(q, q̇) + c(q) + τ_f(q̇) + noise, equations (1), (6).

    The noise is Gaussian, white, independent, as in the paper's section 3. `rate_hz`: a whole number of samples a
    period; `noise_std`, `position_noise_std`, `encoder_step`: (n,) or one for all [Nm or N; rad or m]. Raises
    RobotFileError, RecordingError where there is no such recording.
    """
    samples_per_period = _samples_per_period(motion.period_s, rate_hz)
    if periods < 1:
        raise RecordingError(f"periods is {periods}; record at least 1")
    if motion.centre.shape != (robot.joint_count,):
        raise RecordingError(f"the motion moves {motion.centre.size} joints; the arm has {robot.joint_count}")
    torque_std = _per_joint(noise_std, robot, "noise_std")
    position_std = _per_joint(position_noise_std, robot, "position_noise_std")
    step = _per_joint(encoder_step, robot, "encoder_step")

    one_period = motion.evaluate(np.arange(samples_per_period) / rate_hz)
    torque = _torque(robot, one_period)
    exact = MotionSamples(**{name: np.tile(each, (periods, 1)) for name, each in vars(one_period).items()})
    torque_exact = np.tile(torque, (periods, 1))
    shape = torque_exact.shape
    torque_noise, position_noise = rng.standard_normal(shape), rng.standard_normal(shape)
    return SimulatedRecording(
        time=np.arange(shape[0]) / rate_hz,
        position=quantise(exact.position + position_std * position_noise, step),
        torque=torque_exact + torque_std * torque_noise,
        exact=exact,
        torque_exact=torque_exact,
        period=np.repeat(np.arange(periods, dtype=np.int64), samples_per_period),
    )


def _samples_per_period(period_s: float, rate_hz: float) -> int:
    """Whole number of samples in a period; anything else would blur the average over periods."""
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise RecordingError(f"rate_hz is {rate_hz}; give a positive rate")
    count = period_s * rate_hz
    if round(count) < 1 or abs(count - round(count)) > 1e-9 * count:
        raise RecordingError(
            f"rate_hz {rate_hz:g} puts {count:g} samples into the period of {period_s:g} s; choose a whole number"
        )
    return round(count)


def _per_joint(value: ArrayLike, robot: Robot, name: str) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (1,), (robot.joint_count,)):
        raise RecordingError(f"{name} has {array.size} values; give one, or one for each of {robot.joint_count} joints")
    if not np.all(np.isfinite(array) & (array >= 0.0)):
        raise RecordingError(f"{name} holds a negative or non-finite value; give zero or more")
    return np.broadcast_to(array, (robot.joint_count,))


def _torque(robot: Robot, samples: MotionSamples) -> Array:
    ratios, offsets = robot.ratios, np.array([coupling.offset for coupling in robot.couplings])
    position, velocity, acceleration = (
        each @ ratios.T for each in (samples.position, samples.velocity, samples.acceleration)
    )
    torque = rigid_body_torque(build_model(robot), position + offsets, velocity, acceleration) @ ratios
    if robot.model.friction is None:
        return torque
    shape = [joint.friction_shape for joint in robot.joints]
    return torque + static_friction_torque(samples.velocity, robot.model.friction, shape)


def write_recording_csv(
    path: Path, recording: SimulatedRecording, joints: Sequence[Joint], *, as_current: bool = False
) -> None:
    """Write what a real arm's logger would have written, the joints' wiring included, to the last digit.

    With `as_current` the columns are i1…in, torque by the torque constant. Raises RecordingError where the file cannot
    be made.
    """
    signs = np.array([joint.sign for joint in joints], dtype=np.float64)
    constants = np.array([joint.torque_constant for joint in joints])
    effort = recording.torque * signs / (constants if as_current else 1.0)
    table, columns = np.column_stack([recording.time, recording.position, effort]), "i" if as_current else "tau"
    try:
        with path.open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            names = [f"{group}{number + 1}" for group in ("q", columns) for number in range(len(joints))]
            writer.writerow(["t", *names, "period"])
            # tolist turns a row into Python floats, whose text is the shortest that reads back exactly
            writer.writerows([*row.tolist(), int(period)] for row, period in zip(table, recording.period, strict=True))
    except FileExistsError as error:
        raise RecordingError(
            f"{path}: exists already, and recordings are not overwritten; choose another name"
        ) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
