"""How a parameter changes over many identifications: a weighted straight line, v(t) = a + b t."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import extract_parameters
from tauscope.server.history.model_history import ModelEntry

WEEK_S = 7 * 86400.0


@dataclass(frozen=True)
class TrendPoint:
    """`value`, `std`: estimate and its standard error [SI]."""

    time: datetime
    value: float
    std: float


@dataclass(frozen=True)
class Trend:
    """`slope`: change a week [SI/week]; `change`: of the line from the first point to the last [SI]."""

    count: int
    slope: float
    slope_std: float
    scatter: float
    change: float

    @property
    def in_std(self) -> float:
        return self.slope / self.slope_std


def fit_trend(points: Sequence[TrendPoint]) -> Trend | None:
    """The line by weighted least squares; None where fewer than three points, or all at one time, tell no slope."""
    if len(points) < 3:
        return None
    start = min(point.time for point in points)
    time = np.array([(point.time - start).total_seconds() / WEEK_S for point in points])
    value = np.array([point.value for point in points])
    weight = 1.0 / np.array([point.std for point in points]) ** 2
    centred = time - np.average(time, weights=weight)
    spread = float(np.sum(weight * centred**2))
    if spread <= 0.0:
        return None
    slope = float(np.sum(weight * centred * value)) / spread
    residual = value - np.average(value, weights=weight) - slope * centred
    scatter = math.sqrt(float(np.sum(weight * residual**2)) / (len(points) - 2))
    slope_std = max(1.0, scatter) / math.sqrt(spread)
    return Trend(len(points), slope, slope_std, scatter, slope * float(np.ptp(time)))


@dataclass(frozen=True)
class ParameterTrend:
    """`points`: identifier of each model, and what it says; the oldest first."""

    name: str
    joint: str
    points: tuple[tuple[str, TrendPoint], ...]
    line: Trend | None


def parameter_trends(models: Sequence[tuple[ModelEntry, IdentificationDocument]]) -> list[ParameterTrend]:
    """Every parameter of the newest model, over all `models` that tell it, the oldest first."""
    told = [(entry, {each.name: each for each in extract_parameters(document)}) for entry, document in models]
    trends = []
    for name, newest in told[-1][1].items() if told else ():
        points = tuple(
            (entry.identifier, TrendPoint(entry.created, parameters[name].value, parameters[name].std))
            for entry, parameters in told
            if name in parameters
        )
        trends.append(ParameterTrend(name, newest.joint, points, fit_trend([point for _, point in points])))
    return trends
