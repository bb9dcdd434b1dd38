"""The nearest physically consistent parameters: links that can exist, friction that dissipates."""

from tauscope.identification.consistency.inequalities import (
    LEAST_COULOMB,
    FrictionColumns,
    friction_inequalities,
    mass_inequalities,
)
from tauscope.identification.consistency.nearest import ConsistentParameters, nearest_consistent_parameters
from tauscope.identification.consistency.prior import Prior, far_reaching, plausible_prior

__all__ = [
    "LEAST_COULOMB",
    "ConsistentParameters",
    "FrictionColumns",
    "Prior",
    "far_reaching",
    "friction_inequalities",
    "mass_inequalities",
    "nearest_consistent_parameters",
    "plausible_prior",
]
