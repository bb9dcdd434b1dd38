"""The nearest model that bodies and friction can have, and whether the free estimate could have been one."""

from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.errors import IdentificationError
from tauscope.identification.consistency import (
    ConsistentParameters,
    FrictionColumns,
    friction_inequalities,
    nearest_consistent_parameters,
    plausible_prior,
)
from tauscope.identification.least_squares import Solution
from tauscope.identification.residuals import ResidualStatistics
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

NOISE_DECADES = 6
"""Powers of ten by which the noise may be enlarged where the consistent model is hard to reach."""

CONSISTENCY_LEVEL = 0.999
"""The free estimate counts as impossible, not merely unlucky, where physics rejects it at this level."""


def consistent_estimate(structure: ModelStructure, solution: Solution) -> ConsistentParameters:
    """The nearest parameters that bodies and friction can have, in the metric of the estimate.

    Data that no arm could have made may put the estimate millions of standard errors away from any body. The program is
    then solved for a noise ten times as large, and so on: the same nearest point, with a prior that weighs more.

    Raises
    ------
    IdentificationError
        where no noise makes the program solvable
    """
    robot, base = structure.robot, structure.base
    standard = 10 * robot.joint_count
    size = standard + structure.size - structure.base_count
    factor = np.zeros((structure.size, size))
    factor[:, base.independent_columns] = solution.factor[:, : structure.base_count]
    factor[:, base.dependent_columns] = solution.factor[:, : structure.base_count] @ base.combination
    factor[:, standard:] = solution.factor[:, structure.base_count :]
    columns = _friction_columns(structure, standard - structure.base_count)
    limits = friction_inequalities(columns, size, [joint.name for joint in robot.joints])
    for attempt in range(NOISE_DECADES + 1):
        scale = 10.0**-attempt
        prior = plausible_prior(robot, scale * factor, scale * solution.target, columns)
        try:
            found = nearest_consistent_parameters(scale * factor, scale * solution.target, prior, limits)
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


def _friction_columns(structure: ModelStructure, shift: int) -> FrictionColumns:
    """Where the joints' coefficients stand when `shift` further columns stand before them."""

    def places(name: str) -> tuple[int | None, ...]:
        columns = (structure.coefficient(joint, name) for joint in range(structure.robot.joint_count))
        return tuple(None if column is None else column + shift for column in columns)

    return FrictionColumns(places("stiction"), places("stribeck"), places("viscous"), places("rotor_inertia"))


def in_model_columns(structure: ModelStructure, full: Array) -> Array:
    """Full standard parameters and friction, projected onto the model's columns: Θ* = Θ_L + B Θ_K.

    Parameters
    ----------
    full : (10 n + k,) float64
        standard parameters of all links, then the joints' coefficients

    Returns
    -------
    (p,) float64
        the same model in base parameters
    """
    standard = 10 * structure.robot.joint_count
    return np.concatenate([structure.base.project(full[:standard]), full[standard:]])


def is_rejected(consistent: ConsistentParameters, free: ResidualStatistics) -> bool:
    """Whether no body can have the free estimate, beyond what noise explains.

    The cost of consistency is χ²-like in the noise's own units; a residual that is coloured counts for fewer samples.
    """
    inflation = float(np.mean([model.long_run_ratio for model in free.autoregressions]))
    allowed = stats.chi2.ppf(CONSISTENCY_LEVEL, df=len(consistent.parameters)) * inflation
    return bool(consistent.residual_increase > allowed)
