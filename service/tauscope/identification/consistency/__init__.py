"""The nearest physically consistent parameters: links that can exist, friction that dissipates."""

from tauscope.identification.consistency.nearest import ConsistentParameters, nearest_consistent_parameters
from tauscope.identification.consistency.prior import Prior, far_reaching, plausible_prior

__all__ = ["ConsistentParameters", "Prior", "far_reaching", "nearest_consistent_parameters", "plausible_prior"]
