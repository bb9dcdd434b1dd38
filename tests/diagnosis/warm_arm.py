"""The paper's arm with thermometers: the viscous friction of its first joint falls as that warms up."""

from collections.abc import Sequence

import numpy as np

from diagnosis.diagnosed_arm import POSITION_NOISE, at_joint, motions
from identification.simulated import PAPER_NOISE
from tauscope.recording import Recording

VISCOUS, PER_KELVIN, COLD_C = 1.5, 0.03, 25.0


def warm_recordings(
    seeds: tuple[int, ...],
    courses: Sequence[tuple[float, float]],
    rng: np.random.Generator,
    *,
    per_kelvin: float = PER_KELVIN,
    torque_noise: float = 0.5,
) -> list[Recording]:
    """Recordings in which the first joint warms up from one temperature to another [°C], read in whole degrees."""
    made = []
    for (arm, _), seed, (first, last) in zip(motions(seeds), seeds, courses, strict=True):
        velocity = arm.exact.exact.velocity[:, 0]
        warm = first + (last - first) * np.sqrt(np.linspace(0.0, 1.0, len(velocity)))
        extra = at_joint(0, VISCOUS * np.exp(-per_kelvin * (warm - COLD_C)) * velocity)
        temperature = np.column_stack([np.rint(warm), np.full((len(warm), 2), COLD_C)])
        made.append(
            Recording.from_arrays(
                f"motion-{seed}",
                arm.exact.time,
                arm.exact.exact.position + POSITION_NOISE * rng.standard_normal(arm.exact.torque_exact.shape),
                arm.exact.torque_exact + extra + arm.white(torque_noise * PAPER_NOISE, rng),
                temperature=temperature,
            )
        )
    return made
