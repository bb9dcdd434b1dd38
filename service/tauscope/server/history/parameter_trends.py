"""The parameters of a robot over all its models."""

from collections.abc import Sequence
from dataclasses import dataclass

from tauscope.identification import IdentificationDocument
from tauscope.server.history import Trend, TrendPoint, named_parameters, trend_of
from tauscope.server.history.model_entries import ModelEntry


@dataclass(frozen=True)
class ParameterTrend:
    """One parameter over time.

    points : tuple of (str, TrendPoint)
        identifier of each model, and what it says; the oldest first
    """

    name: str
    joint: str
    points: tuple[tuple[str, TrendPoint], ...]
    line: Trend | None


def parameter_trends(models: Sequence[tuple[ModelEntry, IdentificationDocument]]) -> list[ParameterTrend]:
    """Every parameter that the newest model tells, over all models that tell it.

    Parameters
    ----------
    models : sequence of (ModelEntry, IdentificationDocument)
        every model that was ever active, the oldest first
    """
    told = [(entry, {each.name: each for each in named_parameters(document)}) for entry, document in models]
    trends = []
    for name, newest in told[-1][1].items() if told else ():
        points = tuple(
            (entry.identifier, TrendPoint(entry.created, parameters[name].value, parameters[name].std))
            for entry, parameters in told
            if name in parameters
        )
        trends.append(ParameterTrend(name, newest.joint, points, trend_of([point for _, point in points])))
    return trends
