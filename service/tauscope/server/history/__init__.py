"""Models of one robot over time: whether a new one may be trusted, and what has changed since an earlier one."""

from tauscope.server.history.drift import Drift, drift_between, is_beyond, largest_by_joint
from tauscope.server.history.gates import Gate, check_gates, passes
from tauscope.server.history.parameters import NamedParameter, named_parameters
from tauscope.server.history.policy import ModelPolicy
from tauscope.server.history.trend import Trend, TrendPoint, trend_of
from tauscope.server.history.words import drift_words

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
