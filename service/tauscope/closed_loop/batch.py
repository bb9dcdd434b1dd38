"""Many arms at once, a step at a time: what a refinement simulates, with Tauscope's own dynamics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.closed_loop.laws import RELAXED, LoadFriction
from tauscope.closed_loop.segments import STEP_S, Segments
from tauscope.dynamics import torque_regressor
from tauscope.dynamics.friction import smooth_sign
from tauscope.recording.recording import Array
from tauscope.robot import Actuator, Robot

SWEEPS = 4  # Gauss-Seidel sweeps over the dry friction of coupled joints


@dataclass(frozen=True, eq=False)
class Variants:
    """Parameters of V models of one arm."""

    links: Array  # (V, 10 m), standard parameters
    rotor: Array  # (V, n) [kg m² or kg]
    stiction: Array  # (V, n) [Nm or N]
    viscous: Array  # (V, n) [Nm s/rad or N s/m]
    offset: Array  # (V, n) [Nm or N]
    stribeck: Array  # (n,), the same in all models
    delta: Array  # (n,), the same in all models
    driving: Array  # (V, n), as `LoadFriction`
    braking: Array  # (V, n), as `LoadFriction`
    slope: Array  # (V,), loss of torque per volt with temperature [1/K]


def simulate_segments(robot: Robot, loops: Sequence[Actuator], segments: Segments, models: Variants) -> Array:
    """Positions of all segments under all models, (K, n, S, V) [rad or m]."""
    steps, joints, count = segments.position.shape
    number = len(models.links)
    shape = (joints, count, number)
    position = np.repeat(segments.position[0][:, :, None], number, axis=2)
    velocity = np.repeat(segments.begin[:, :, None], number, axis=2)
    stiction, viscous, offset, rotor, driving, braking = (
        values.T[:, None, :]
        for values in (models.stiction, models.viscous, models.offset, models.rotor, models.driving, models.braking)
    )
    friction = LoadFriction(driving, braking)
    stribeck, delta = models.stribeck[:, None, None], models.delta[:, None, None]
    found, acceleration, load = np.empty((steps, *shape)), np.zeros(shape), np.zeros(shape)
    for step in range(steps):
        found[step] = position
        drive = _drive(loops, segments, step, position, velocity, models.slope)
        mass, bias = _dynamics(robot, models.links, position, velocity)
        newest = bias + np.einsum("ijsv,jsv->isv", mass, acceleration)
        load = newest if step == 0 else (1.0 - RELAXED) * load + RELAXED * newest
        for joint in range(joints):
            mass[joint, joint] += rotor[joint]
        inverse = _invert(mass)
        free = drive - bias - offset - viscous * velocity
        faster = velocity + STEP_S * np.einsum("ijsv,jsv->isv", inverse, free)
        level = stiction + stribeck * smooth_sign(np.abs(velocity), delta)
        level = np.maximum(level + friction.level(load, np.sign(faster)), 0.0)
        faster = _brake(inverse, faster, STEP_S * level)
        acceleration = (faster - velocity) / STEP_S
        velocity = faster
        position = position + STEP_S * velocity
    return found


def _drive(
    loops: Sequence[Actuator], segments: Segments, step: int, position: Array, velocity: Array, slope: Array
) -> Array:
    torque = np.empty_like(position)
    for joint, loop in enumerate(loops):
        channels = (segments.voltage, segments.gain, segments.temperature)
        known = [values[step, joint][:, None] for values in channels]
        measured = position[joint] if loop.kind == "position" else velocity[joint]
        error = segments.command[step, joint][:, None] - measured
        made = np.asarray(loop.torque(error, 0.0, *known))
        if segments.warmth is not None:
            made = made / (1.0 + slope * segments.warmth[step, joint][:, None])
        torque[joint] = made - loop.damping * velocity[joint]
    return torque


def _dynamics(robot: Robot, links: Array, position: Array, velocity: Array) -> tuple[Array, Array]:
    joints, count, number = position.shape
    q, qd = (values.reshape(joints, -1).T for values in (position, velocity))
    zero = np.zeros_like(q)
    units = [np.broadcast_to(np.eye(joints)[joint], q.shape) for joint in range(joints)]
    speeds, accelerations = [qd, *[zero] * (joints + 1)], [zero, zero, *units]
    stacked = (np.concatenate(parts) for parts in ([q] * (joints + 2), speeds, accelerations))
    regressor = torque_regressor(robot, *stacked)
    weights = np.tile(links, (count, 1))
    torque = np.einsum("rbjc,bc->rjb", regressor.reshape(joints + 2, count * number, joints, -1), weights)
    torque = torque.reshape(joints + 2, joints, count, number)
    return (torque[2:] - torque[1]).transpose(1, 0, 2, 3), torque[0]


def _invert(mass: Array) -> Array:
    if len(mass) == 1:
        return 1.0 / mass
    return np.asarray(np.linalg.inv(mass.transpose(2, 3, 0, 1)), dtype=np.float64).transpose(2, 3, 0, 1)


def _brake(inverse: Array, velocity: Array, most: Array) -> Array:
    """Velocity after an impulse of dry friction of at `most`, (n, S, V), which never turns a joint round."""
    impulse, out = np.zeros_like(velocity), velocity.copy()
    for _ in range(SWEEPS if len(velocity) > 1 else 1):
        for joint in range(len(velocity)):
            wanted = np.clip(impulse[joint] - out[joint] / inverse[joint, joint], -most[joint], most[joint])
            out = out + inverse[:, joint] * (wanted - impulse[joint])
            impulse[joint] = wanted
    return out
