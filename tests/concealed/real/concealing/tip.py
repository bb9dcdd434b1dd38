"""What happens at the tip for a while: a force, τ = Jᵀ F, and a mass that is picked up."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.passage import Passage
from tauscope.dynamics.regressor import torque_regressor
from tauscope.robot import Robot

Array = NDArray[np.float64]

PARAMETERS = 10
"""Standard parameters a link: six of inertia, the mass, three first moments."""

MASS = 6

RAMP = 0.15
"""Share of a contact in which its force rises, and in which it falls."""

LONGEST_ARM_M = 0.15
"""Distance of a carried mass from the last link's origin, at most."""


def tip_torque(robot: Robot, position: Array, force: Array) -> Array:
    """Torque (N, n) that holds a force F against the surroundings at the last link's origin, Jᵀ F.

    A unit mass that rests there under the acceleration -F is held by the same torque.
    """
    column = np.array([PARAMETERS * (robot.joint_count - 1) + MASS])
    still = np.zeros_like(position)
    pulled = replace(robot, gravity=-np.asarray(force, float))
    return np.array(torque_regressor(pulled, position, still, still, columns=column)[:, :, 0])


def mass_torque(robot: Robot, position: Array, velocity: Array, acceleration: Array, place: Array) -> Array:
    """Torque (N, n) of one kilogram at a place of the last link's frame."""
    squares, (x, y, z) = float(place @ place), place
    inertia = [squares - x * x, squares - y * y, squares - z * z, -x * y, -x * z, -y * z]
    columns = np.arange(PARAMETERS * (robot.joint_count - 1), PARAMETERS * robot.joint_count)
    regressor = torque_regressor(robot, position, velocity, acceleration, columns=columns)
    return np.asarray(regressor @ np.array([*inertia, 1.0, x, y, z]))


def contact(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A force at the tip in a drawn direction, once in every recording at the same time after its beginning.

    Where the joint bends to the force.
    """
    direction = rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    length = float(rng.uniform(0.08, 0.25)) * ground.duration
    start = float(rng.uniform(0.15, 0.9 - length / ground.duration)) * ground.duration

    def window(time: Array) -> Array:
        phase = (time - start) / length
        return np.clip(np.minimum(phase, 1.0 - phase) / RAMP, 0.0, 1.0)

    def torque(passage: Passage, _load: Array) -> Array:
        return window(passage.time)[:, None] * tip_torque(ground.robot, passage.position, direction)

    labels = ("external_contact",)
    if ground.robot.joint_count == 1:
        labels = (*labels, f"external_contact@{ground.names[0]}")
    constants = {f"F_{axis}": float(each) for axis, each in zip("xyz", direction, strict=True)}
    return Concealment(
        "contact",
        joint,
        labels,
        lambda size: {"force": size, "t_0": start, "t_1": start + length},
        (0.0, np.inf),
        torque=torque,
        window=window,
        constants=constants,
    )


def payload_change(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A point mass on the last link from the same time after the beginning of every recording on."""
    place = rng.standard_normal(3)
    place *= LONGEST_ARM_M * rng.uniform(0.2, 1.0) / np.linalg.norm(place)
    start = float(rng.uniform(0.3, 0.65)) * ground.duration

    def window(time: Array) -> Array:
        return np.asarray(time >= start, float)

    def torque(passage: Passage, _load: Array) -> Array:
        motion = passage.position, passage.velocity, passage.acceleration
        return window(passage.time)[:, None] * mass_torque(ground.robot, *motion, place)

    constants = {f"r_{axis}": float(each) for axis, each in zip("xyz", place, strict=True)}
    return Concealment(
        "payload_change",
        joint,
        ("payload_change",),
        lambda size: {"m": size, "t_on": start},
        (0.0, np.inf),
        torque=torque,
        window=window,
        constants=constants,
    )
