"""What is said of models over time."""

from collections.abc import Sequence
from dataclasses import asdict

from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import largest_by_joint
from tauscope.server.history.model_history import ModelEntry
from tauscope.server.history.model_judgement import compared
from tauscope.server.history.trend import parameter_trends
from tauscope.server.http.history.models import (
    ComparisonAnswer,
    DriftAnswer,
    GateAnswer,
    LineAnswer,
    ModelAnswer,
    ModelLinksAnswer,
    ParameterTrendAnswer,
    TrendAnswer,
    TrendPointAnswer,
)


def model_answer(entry: ModelEntry, collection: str) -> ModelAnswer:
    """The answer that holds a model."""
    here = f"{collection}/{entry.identifier}"
    return ModelAnswer(
        id=entry.identifier,
        site=entry.site,
        robot=entry.robot,
        created=entry.created,
        considered=entry.considered,
        source=entry.source,  # pyright: ignore[reportArgumentType] - checked by the model
        state=entry.state,  # pyright: ignore[reportArgumentType]
        is_reference=entry.is_reference,
        gates=tuple(GateAnswer.model_validate(gate) for gate in entry.gates),
        links=ModelLinksAnswer(self=here, document=f"{here}/document"),
    )


def comparison_answer(
    before: str, earlier: IdentificationDocument, after: str, later: IdentificationDocument
) -> ComparisonAnswer:
    """The answer that compares two models."""
    drifts = compared(earlier, later)
    return ComparisonAnswer(
        before=before,
        after=after,
        parameters=[DriftAnswer.model_validate(drift) for drift in drifts],
        joints={joint: DriftAnswer.model_validate(drift) for joint, drift in largest_by_joint(drifts).items()},
    )


def trend_answer(robot: str, models: Sequence[tuple[ModelEntry, IdentificationDocument]]) -> TrendAnswer:
    """The answer that shows a robot's parameters over time.

    Parameters
    ----------
    models : sequence of (ModelEntry, IdentificationDocument)
        every model that was ever active, the oldest first
    """
    parameters = []
    for trend in parameter_trends(models):
        points = [TrendPointAnswer(**asdict(point), model=model) for model, point in trend.points]
        line = None if trend.line is None else LineAnswer.model_validate(trend.line)
        parameters.append(ParameterTrendAnswer(name=trend.name, joint=trend.joint, points=points, line=line))
    return TrendAnswer(robot=robot, parameters=parameters)
