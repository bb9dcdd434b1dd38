"""The paper's arm with encoders on its links: the motors turn on by what their transmissions give way."""

from collections.abc import Sequence

import numpy as np

from diagnosis.diagnosed_arm import motions
from identification.simulated import PAPER_NOISE, Array
from tauscope.recording import Recording

ENCODER_NOISE = 2e-5


def give_way(rigid: Array, compliance: Sequence[float], play: Sequence[float]) -> Array:
    """q - q_link under the load, (N, n) [rad]."""
    return np.asarray(compliance) * rigid + 0.5 * np.asarray(play) * np.sign(rigid)


def linked_recordings(
    seeds: tuple[int, ...],
    rng: np.random.Generator,
    *,
    compliance: Sequence[float] = (0.0, 0.0, 0.0),
    play: Sequence[float] = (0.0, 0.0, 0.0),
    mounting: bool = True,
    step: float = 0.0,
    torque_noise: float = 0.3,
) -> list[Recording]:
    """Recordings with columns qlink.

    Parameters
    ----------
    mounting : bool
        whether the encoders on the links have an offset, run eccentrically, and are read later
    step : float
        of all encoders [rad]
    torque_noise : float
        relative to the paper's
    """
    made = []
    for (arm, rigid), seed in zip(motions(seeds), seeds, strict=True):
        true = arm.exact.exact
        link = true.position.copy()
        if mounting:
            link += 0.3 + 2e-4 * np.cos(true.position + 0.7) - 4e-4 * true.velocity
        motor = true.position + give_way(rigid, compliance, play)
        noise = ENCODER_NOISE * rng.standard_normal((2, *rigid.shape))
        motor, link = motor + noise[0], link + noise[1]
        if step > 0.0:
            motor, link = (step * np.rint(each / step) for each in (motor, link))
        torque = arm.exact.torque_exact + arm.white(torque_noise * PAPER_NOISE, rng)
        made.append(Recording.from_arrays(f"motion-{seed}", arm.exact.time, motor, torque, link_position=link))
    return made
