"""The most probable model that bodies and friction can have, and whether the free estimate could have been one."""

from dataclasses import replace

from scipy import stats

from tauscope.errors import IdentificationError
from tauscope.identification.consistency import ConsistentParameters, Prior, nearest_consistent_parameters
from tauscope.identification.consistency.inequalities import friction_inequalities, mass_inequalities
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

NOISE_DECADES = 6  # powers of ten by which the noise may be enlarged where the consistent model is hard to reach
LEAST_MASS = 0.1  # no link weighs less than this share of what is believed of it, whatever its equations say
# The free estimate counts as impossible, not merely unlucky, where physics rejects it at this level.
CONSISTENCY_LEVEL = 0.999


def consistent_estimate(structure: ModelStructure, factor: Array, target: Array, prior: Prior) -> ConsistentParameters:
    """The most probable parameters that bodies and friction can have.

    Data that no arm could have made may put the estimate millions of standard errors away from any body. The program is
    then solved for a noise ten times as large, and so on: the prior weighs more. Raises IdentificationError where no
    noise makes the program solvable.

    `factor`, `target`: (r, p), (r,), R and z of the whitened equations of the model's columns.
    """
    full = FullParameters.of(structure)
    columns = factor @ full.map
    joints = [joint.name for joint in structure.robot.joints]
    size = columns.shape[1]
    limits = friction_inequalities(full.friction, size, joints) + mass_inequalities(LEAST_MASS * prior.masses, size)
    for attempt in range(NOISE_DECADES + 1):
        scale = 10.0**-attempt
        try:
            found = nearest_consistent_parameters(scale * columns, scale * target, prior, limits)
        except IdentificationError:
            if attempt == NOISE_DECADES:
                raise
            continue
        return replace(
            found,
            squared_residual=found.squared_residual / scale**2,
            free_squared_residual=found.free_squared_residual / scale**2,
        )
    raise AssertionError("the last attempt returns or raises")


def is_rejected(consistent: ConsistentParameters) -> bool:
    """Whether no body can have the free estimate, beyond what noise explains: what consistency costs is χ²-like."""
    allowed = stats.chi2.ppf(CONSISTENCY_LEVEL, df=len(consistent.parameters))
    return bool(consistent.residual_increase > allowed)
