"""How a parameter changes over many identifications: a weighted straight line, v(t) = a + b t."""

import math
from collections.abc import Sequence
from datetime import datetime

import numpy as np
from pydantic import Field

from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import extract_parameters
from tauscope.server.history.model_history import ModelEntry
from tauscope.strict_model import entry

WEEK_S = 7 * 86400.0


@entry
class TrendPoint:
    time: datetime = Field(description="when its identification was handed in, UTC")
    value: float = Field(description="estimate [SI]")
    std: float = Field(description="its standard error [SI]")
    model: str = Field(default="", description="identifier of the model")


@entry
class Trend:
    count: int = Field(description="number of points")
    slope: float = Field(description="change a week [SI]")
    slope_std: float = Field(description="its standard error, scatter of the points included [SI]")
    scatter: float = Field(description="1 where the points scatter as their standard errors say")
    change: float = Field(description="of the line from the first point to the last [SI]")
    in_std: float = Field(description="slope in its standard errors")


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
    return Trend(len(points), slope, slope_std, scatter, slope * float(np.ptp(time)), slope / slope_std)


@entry
class ParameterTrend:
    name: str = Field(description="of the parameter")
    joint: str = Field(description="that it belongs to")
    points: list[TrendPoint] = Field(description="in every model that was ever active, the oldest first")
    line: Trend | None = Field(description="null before there are three points")


def parameter_trends(models: Sequence[tuple[ModelEntry, IdentificationDocument]]) -> list[ParameterTrend]:
    """Every parameter of the newest model, over all `models` that tell it, the oldest first."""
    told = [(model, {each.name: each for each in extract_parameters(document)}) for model, document in models]
    trends = []
    for name, newest in told[-1][1].items() if told else ():
        points = [
            TrendPoint(model.created, parameters[name].value, parameters[name].std, model.identifier)
            for model, parameters in told
            if name in parameters
        ]
        trends.append(ParameterTrend(name, newest.joint, points, fit_trend(points)))
    return trends
