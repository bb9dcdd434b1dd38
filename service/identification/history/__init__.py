"""Models of one robot over time: whether a new one may be trusted, and what has changed since an earlier one."""

from service.identification.history.drift import Drift, drift_between, is_beyond, largest_by_joint
from service.identification.history.gates import Gate, check_gates, passes
from service.identification.history.parameters import NamedParameter, named_parameters
from service.identification.history.policy import ModelPolicy
from service.identification.history.trend import Trend, TrendPoint, trend_of
from service.identification.history.words import drift_words

__all__ = [
    "Drift",
    "Gate",
    "ModelPolicy",
    "NamedParameter",
    "Trend",
    "TrendPoint",
    "check_gates",
    "drift_between",
    "drift_words",
    "is_beyond",
    "largest_by_joint",
    "named_parameters",
    "passes",
    "trend_of",
]
