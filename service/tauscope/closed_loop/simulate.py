"""The closed loop in the simulator, from one restart at the real state to the next."""

import numpy as np

from tauscope.closed_loop.drive import Drive, RecordedMotion
from tauscope.closed_loop.load_friction import RELAXED
from tauscope.closed_loop.model import RolloutModel
from tauscope.closed_loop.plant import STEP_S, Plant
from tauscope.errors import TauscopeError
from tauscope.recording.recording import Array

LOST = 1e3  # position error beyond which the simulated arm is lost and held there [rad or m]


def simulate_motion(
    model: RolloutModel, plant: Plant, drive: Drive, motion: RecordedMotion, horizon_s: float | None
) -> Array:
    """Positions of the simulated arm at the rows of the recording, (N, n) [rad or m].

    Raises TauscopeError where the recording holds no torque for a joint.

    `horizon_s`: time between restarts at the real state [s]; None starts once.
    """
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
