"""The closed loop in the simulator: torque of its drives, from one restart at the real state to the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tauscope.actuation import shift_command
from tauscope.actuation.smooth_motion import put_onto
from tauscope.closed_loop.laws import RELAXED
from tauscope.closed_loop.model import RolloutModel
from tauscope.closed_loop.plant import STEP_S, Plant
from tauscope.errors import TauscopeError
from tauscope.recording import Recording
from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.recording import Array
from tauscope.robot import Actuator, Robot

# Bandwidth of the stabiliser [rad/s]: 1 Hz holds a drift of minutes and leaves the motion itself to the model.
STABILISER_RAD_S = 2.0 * np.pi
# Band of the velocity that restarts begin with, where none was recorded [Hz]: above it are steps of the encoder.
STATE_BAND_HZ = 15.0


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """A recording on the steps of a rollout, `time` (K,) [s]; `position`, `velocity`: (K, n) of the real arm."""

    name: str
    time: Array
    position: Array
    velocity: Array
    rows: Array  # (N,), instants of the recording [s]
    measured: Array  # (N, n), q at these instants; NaN where it was missed


class Drive(Protocol):
    """Torque of all joints."""

    def torque(self, step: int, position: Array, velocity: Array) -> Array:
        """Torque at a step, (n,) [Nm or N]. `position`, `velocity`: (n,), q, q̇ of the simulated arm."""
        ...


def record_motion(recording: Recording) -> RecordedMotion:
    """A recording on the steps of a rollout."""
    samples = recording.samples()
    time = np.arange(samples.time[0], samples.time[-1] + 0.5 * STEP_S, STEP_S)
    position = _onto(samples.time, samples.position, time)
    velocity = np.gradient(smooth(position, 1.0 / STEP_S, STATE_BAND_HZ), STEP_S, axis=0)
    if samples.velocity is not None and np.isfinite(samples.velocity).any(axis=0).all():
        velocity = _onto(samples.time, samples.velocity, time)
    return RecordedMotion(recording.name, time, position, velocity, samples.time, samples.position)


def loop_damping(loops: Sequence[Actuator]) -> Array:
    """Torque per velocity of each loop, (n,) [Nm s/rad or N s/m]."""
    return np.array([loop.damping for loop in loops])


class LoopDrive:
    """Position or velocity loops on recorded commands."""

    def __init__(self, loops: Sequence[Actuator], recording: Recording, time: Array, *, is_damped: bool) -> None:
        """Put commands, supplies and gains on the steps; the plant has the loops' damping unless `is_damped`."""
        self._damped = 1.0 if is_damped else 0.0
        samples = recording.samples()
        reference = samples.reference if samples.reference is not None else samples.effort
        self._loops = tuple(loops)
        self.command = np.empty((len(time), len(self._loops)))
        for joint, loop in enumerate(self._loops):
            command = shift_command(samples.time, reference[:, joint], loop.delay or 0.0, loop.rate_hz, time)
            self.command[:, joint] = command if loop.kind == "position" else np.gradient(command, STEP_S)
        self.voltage, self.gain, self.temperature = (
            None if values is None else _onto(samples.time, values, time)
            for values in (samples.voltage, samples.gain, samples.temperature)
        )

    def torque(self, step: int, position: Array, velocity: Array) -> Array:
        """Torque at a step, (n,) [Nm or N]. `position`, `velocity`: (n,), q, q̇ of the simulated arm."""
        out = np.empty(len(self._loops))
        for joint, loop in enumerate(self._loops):
            measured = position[joint] if loop.kind == "position" else velocity[joint]
            out[joint] = loop.torque(
                float(self.command[step, joint] - measured),
                self._damped * float(velocity[joint]),
                None if self.voltage is None else float(self.voltage[step, joint]),
                None if self.gain is None else float(self.gain[step, joint]),
                None if self.temperature is None else float(self.temperature[step, joint]),
            )
        return out


class TorqueDrive:
    """Recorded torque, and a stabiliser that draws the simulated arm to the real one."""

    def __init__(self, robot: Robot, recording: Recording, motion: RecordedMotion, inertia: Array) -> None:
        samples = recording.samples()
        effort = samples.effort if samples.effort_command is None else samples.effort_command
        torque = recording.joint_torque(effort, robot)
        self._torque = _onto(samples.time, torque, motion.time)
        self._motion = motion
        self._stiffness, self._damping = inertia * STABILISER_RAD_S**2, 2.0 * inertia * STABILISER_RAD_S
        self.squares, self.steps = np.zeros(len(inertia)), 0

    def torque(self, step: int, position: Array, velocity: Array) -> Array:
        """Torque at a step, (n,) [Nm or N]. `position`, `velocity`: (n,), q, q̇ of the simulated arm."""
        motion = self._motion
        ahead, faster = motion.position[step] - position, motion.velocity[step] - velocity
        added = self._stiffness * ahead + self._damping * faster
        self.squares += added**2
        self.steps += 1
        return self._torque[step] + added

    @property
    def stabiliser_rms(self) -> Array:
        """Rms of the stabiliser's torque so far, (n,) [Nm or N]."""
        return np.sqrt(self.squares / max(self.steps, 1))


def _onto(time: Array, values: Array, at: Array) -> Array:
    """Columns (N, n) at other instants, NaN where all is missed."""
    return np.stack([put_onto(time, column, at, np.nan) for column in values.T], axis=1)


LOST = 1e3  # position error beyond which the simulated arm is lost and held there [rad or m]


def simulate_motion(
    model: RolloutModel, plant: Plant, drive: Drive, motion: RecordedMotion, horizon_s: float | None
) -> Array:
    """Simulated positions at a recording's rows, (N, n), restarted every horizon. Raises TauscopeError."""
    steps = len(motion.time)
    every = steps if horizon_s is None else max(round(horizon_s / STEP_S), 1)
    found = np.empty_like(motion.position)
    # The state before a restart is that at its end, so that both sides of it can be compared.
    load = np.zeros(motion.position.shape[1])
    for step in range(steps):
        if step % every == 0:
            plant.reset(motion.position[step], motion.velocity[step])
            load = plant.load.copy()
        position, velocity = plant.position.copy(), plant.velocity.copy()
        found[step] = position
        if not np.all(np.abs(position - motion.position[step]) < LOST):
            found[step:] = motion.position[step:] + LOST
            break
        torque = drive.torque(step, position, velocity)
        if not np.all(np.isfinite(torque)):
            raise TauscopeError(f"{motion.name}: no torque and no command at t = {motion.time[step]:.4g} s")
        dry, against = model.laws(position, velocity, load, torque)
        plant.advance(torque - against, dry)
        load = (1.0 - RELAXED) * load + RELAXED * plant.load
    return np.stack([np.interp(motion.rows, motion.time, column) for column in found.T], axis=1)
