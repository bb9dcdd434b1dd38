"""Torque per volt where nothing states it: by the stated masses, which gravity and inertia weigh.

u = (W θ) / κ + a sgn q̇ + b q̇ + c, with u the volts of the bridge and θ the stated links.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.actuation.delay import Delay, joint_torque
from tauscope.actuation.smooth_motion import SmoothMotion
from tauscope.dynamics import torque_regressor
from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array
from tauscope.robot import Joint, Robot

STATED_MASS_STD = 0.1  # relative standard error of stated masses: a data sheet's sum, or CAD without screws and cables
KNOWN_STD = 0.3  # relative standard error above which a joint does not tell its torque per volt


def is_open(joint: Joint) -> bool:
    """Whether a register loop has no torque per volt."""
    loop = joint.actuator
    return loop is not None and loop.has_loop and loop.unit == "register" and loop.volt_torque is None


def with_torque_per_volt(robot: Robot, values: dict[int, float], std: float | None = None) -> Robot:
    """The robot with torque per volt of some joints by index [Nm/V or N/V]; `std` is relative."""
    loops = list(robot.actuators)
    for place, value in values.items():
        if (loop := loops[place]) is not None:
            own = std if loop.scale_std is None else loop.scale_std
            loops[place] = replace(loop, torque_per_volt=value, scale_std=own)
    return robot.with_actuators(loops)


def estimate_torque_per_volt(
    robot: Robot, recordings: Sequence[Recording], delays: Sequence[Delay], joints: Sequence[int]
) -> dict[int, float]:
    """Torque per volt by joint, from a robot with 1 Nm/V there; a joint that tells nothing takes its servo's."""
    links = robot.model.links
    if links is None:
        return {}
    stated = np.concatenate([link.to_vector() for link in links])
    motions = [SmoothMotion.of(recording) for recording in recordings]
    bodies = [torque_regressor(robot, m.position, m.velocity, m.acceleration) @ stated for m in motions]
    found = {}
    for joint in joints:
        rows, volts, weights = [], [], []
        for motion, torque in zip(motions, bodies, strict=True):
            moves = motion.moves(joint)
            made = motion.onto(joint_torque(robot, motion.samples, joint, delays[joint].value))
            rows.append(motion.reduce(torque[:, [joint]], joint))
            volts.append(smooth(made[:, None], motion.rate, motion.band)[moves, 0])
            weights.append(moves.sum() * motion.independent)
        value = _fit(np.concatenate(rows), np.concatenate(volts), float(sum(weights)))
        if value is not None:
            found[joint] = value
    servos = {joint: loop.servo for joint, loop in enumerate(robot.actuators) if loop is not None}
    for joint in joints:
        same = [value for other, value in found.items() if servos.get(other) == servos.get(joint)]
        if joint not in found and same:
            found[joint] = float(np.median(same))
    return found


def _fit(rows: Array, volts: Array, count: float) -> float | None:
    """κ by least squares; None where its standard error is above `KNOWN_STD` or it is negative."""
    if len(rows) <= rows.shape[1]:
        return None
    solution, _, rank, _ = np.linalg.lstsq(rows, volts, rcond=1e-9)
    if rank < rows.shape[1]:
        return None
    left = float(np.mean((volts - rows @ solution) ** 2)) * len(rows) / max(count, 1.0)
    std = float(np.sqrt(left * np.linalg.inv(rows.T @ rows)[0, 0]))
    return float(1.0 / solution[0]) if solution[0] > 0.0 and std < KNOWN_STD * solution[0] else None
