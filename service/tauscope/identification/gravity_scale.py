"""How large gravity's torque is beside that of the masses which the robot file states."""

import numpy as np

from tauscope.dynamics.regressor import torque_regressor
from tauscope.identification.dataset import Dataset
from tauscope.identification.excitation import thin
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

POSTURES = 200  # of the training motion, by which both are compared
FELT = 1e-3  # gravity below this share of the masses' weight at one metre, per kilogram, does not show [Nm/Nm]


def gravity_scale(motions: Dataset, structure: ModelStructure, parameters: Array) -> float | None:
    """Least-squares factor between the estimated torque of gravity and that of the stated links.

    `parameters`: (p,), the estimate.
    Returns 1 where both agree; None where the file states no links, or gravity does not show.
    """
    links = structure.robot.model.links
    if links is None:
        return None
    position = thin(np.concatenate([thin(prepared.motion.position, POSTURES) for prepared in motions]), POSTURES)
    still = np.zeros_like(position)
    columns = torque_regressor(
        structure.robot, position, still, still, columns=np.asarray(structure.base.independent_columns)
    )
    stated = columns @ structure.base.project(np.concatenate([link.to_vector() for link in links]))
    weight = sum(link.mass for link in links) * float(np.linalg.norm(structure.robot.gravity))
    power = float(np.mean(stated**2))
    if power <= (FELT * weight) ** 2:
        return None
    return float(np.mean(stated * (columns @ parameters[: structure.base_count])) / power)
