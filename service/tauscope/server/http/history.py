"""Models over HTTP: their history, gates, trends, policies and events."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Response
from pydantic import Field

from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import Drift, ParameterTrend, find_largest_by_joint, parameter_trends
from tauscope.server.history.gates import Gate, ModelPolicy
from tauscope.server.history.model_history import ModelEntry, ModelEventEntry
from tauscope.server.history.model_judgement import compare_models
from tauscope.server.http.answers import ROOT, AnswerModel, Identifier, Limit
from tauscope.server.http.openapi import takes_document
from tauscope.server.http.services import ServicesDep, document_of
from tauscope.server.problems import problem_responses
from tauscope.server.store.data_folder import utc_now
from tauscope.strict_model import StrictModel


class ReasonRequest(StrictModel):
    """Why somebody decides something; kept with the decision."""

    reason: Annotated[str, Field(min_length=1, max_length=1000)] = Field(description="one line", examples=["new oil"])


class ModelLinksAnswer(AnswerModel):
    self_: str = Field(alias="self", description="the model")
    document: str = Field(description="what it says: the identification's document")


class ModelAnswer(AnswerModel):
    id: str = Field(description="identifier of the identification", examples=["20261103T101502Z-1f2e3d4c"])
    site: str = Field(description="identifier of the data folder that holds the identification")
    robot: str = Field(description="name of the robot")
    created: datetime = Field(description="when the identification was handed in, UTC")
    considered: datetime = Field(description="when it was judged, UTC")
    source: Literal["arm", "simulated", "uploaded"] = Field(description="what was measured")
    state: Literal["active", "kept", "refused", "unreadable"] = Field(
        description="active: in use; kept: was in use; refused: did not pass a gate; unreadable: its result is damaged"
    )
    is_reference: bool = Field(description="whether drift is counted from this model")
    gates: tuple[Gate, ...] = Field(description="what it had to show")
    links: ModelLinksAnswer = Field(description="where to go on")


class ModelListAnswer(AnswerModel):
    models: list[ModelAnswer] = Field(description="the newest first")


class ComparisonAnswer(AnswerModel):
    before: str = Field(description="identifier of the model that it is compared with")
    after: str = Field(description="identifier of this model")
    parameters: tuple[Drift, ...] = Field(description="every parameter that both tell")
    joints: Mapping[str, Drift] = Field(description="for each joint its most significant change")


class TrendAnswer(AnswerModel):
    robot: str = Field(description="name of the robot")
    parameters: list[ParameterTrend] = Field(description="in the order of the newest model")


class EventListAnswer(AnswerModel):
    events: list[ModelEventEntry] = Field(description="the newest first")


def make_model_answer(entry: ModelEntry) -> ModelAnswer:
    here = f"{ROOT}/models/{entry.identifier}"
    links = ModelLinksAnswer(self=here, document=f"{here}/document")
    return ModelAnswer.describe(entry, id=entry.identifier, links=links)


router = APIRouter(tags=["models"], responses=problem_responses("store"))
RobotName = Annotated[str, Query(alias="robot", min_length=1, max_length=1000, description="name of the robot")]
AnyRobot = Annotated[str | None, Query(alias="robot", max_length=1000, description="name of the robot; default: any")]
Number = Annotated[int, Path(ge=1, le=2**31 - 1, description="number of the event")]
Reason = Annotated[ReasonRequest, document_of(ReasonRequest)]
_WHY = {"why": ("Why", {"reason": "gear oil changed on 3 November"})}
_WITH_REASON: Any = takes_document(ReasonRequest, _WHY, "not-found")
_DRIFT = {"drift": ("Tell smaller changes", {"drift_share": 0.1, "drift_std": 5})}


@router.get("/models", summary="List models")
def list_models(services: ServicesDep, robot: AnyRobot = None, limit: Limit = 100) -> ModelListAnswer:
    """Every identification that was judged: the active one of each robot, those that were, those that were refused."""
    services.judge_new()
    entries = services.models.history.models(robot, limit)
    return ModelListAnswer(models=[make_model_answer(entry) for entry in entries])


@router.get("/models/{identifier}", summary="Look a model up", responses=problem_responses("not-found"))
def get_model(identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """Its state and the gates that it had to pass; the identifier is the identification's."""
    services.judge_new()
    return make_model_answer(services.models.history.find(identifier))


@router.get(
    "/models/{identifier}/document",
    summary="Fetch what a model says",
    response_class=Response,
    responses={
        200: {"model": IdentificationDocument, "description": "the identification's document"},
        **problem_responses("not-found"),
    },
)
def get_model_document(identifier: Identifier, services: ServicesDep) -> Response:
    """Kept with the history, also where the identification itself was removed."""
    content = services.models.history.document(identifier).model_dump_json(by_alias=True)
    return Response(content, media_type="application/json")


@router.get("/models/{identifier}/drift", summary="Compare a model", responses=problem_responses("not-found"))
def get_model_drift(
    identifier: Identifier,
    services: ServicesDep,
    since: Annotated[str | None, Query(max_length=100, description="identifier of the model before it")] = None,
) -> ComparisonAnswer:
    """The change of every parameter, in joint standard errors; since the reference where no other model is named."""
    history = services.models.history
    after, robot = history.document(identifier), history.find(identifier).robot
    before = since or next((each.identifier for each in history.models(robot, 10_000) if each.is_reference), None)
    if before is None:
        raise NotFoundError("no model of this robot has passed yet, so there is no reference; name one with since")
    drifts = compare_models(history.document(before), after)
    return ComparisonAnswer(before=before, after=identifier, parameters=drifts, joints=find_largest_by_joint(drifts))


@router.post("/models/{identifier}/activate", summary="Make a model the active one", **_WITH_REASON)
def activate_model(body: Reason, identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """Also one that was refused; the one before is kept. The reason is kept with the choice."""
    return make_model_answer(services.models.history.activate(identifier, "active", body.reason, utc_now()))


@router.post("/models/{identifier}/make-reference", summary="Count drift from a model", **_WITH_REASON)
def make_reference(body: Reason, identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """After maintenance, say; drifts that are open are closed."""
    return make_model_answer(services.models.history.activate(identifier, "reference", body.reason, utc_now()))


@router.get("/trend", summary="Follow the parameters of a robot", responses=problem_responses("not-found"))
def get_trend(services: ServicesDep, robot: RobotName) -> TrendAnswer:
    """Every parameter in every model that was ever active, and the straight line through it."""
    services.judge_new()
    return TrendAnswer(robot=robot, parameters=parameter_trends(services.models.history.documents(robot)))


@router.get("/model-policy", summary="Look up the bounds of a robot", responses=problem_responses("not-found"))
def get_policy(services: ServicesDep, robot: RobotName) -> ModelPolicy:
    """By which its new models are judged, and beyond which a drift is told."""
    return services.models.history.policy(robot)


@router.put("/model-policy", summary="Set the bounds of a robot", **takes_document(ModelPolicy, _DRIFT, "not-found"))
def set_policy(
    policy: Annotated[ModelPolicy, document_of(ModelPolicy)], services: ServicesDep, robot: RobotName
) -> ModelPolicy:
    """They hold for models that are judged from now on; what is left out takes its default."""
    services.models.history.set_policy(robot, policy)
    return policy


@router.get("/events", summary="Read what people should know")
def list_events(
    services: ServicesDep,
    robot: AnyRobot = None,
    only_open: Annotated[bool, Query(alias="open", description="only what nobody has taken note of")] = False,
    limit: Limit = 100,
) -> EventListAnswer:
    """Parameters that have drifted beyond the bounds; one event for each, brought up to date while it is open."""
    services.judge_new()
    return EventListAnswer(events=services.models.history.events(robot, only_open=only_open, limit=limit))


@router.post("/events/{number}/acknowledge", summary="Take note of an event", **_WITH_REASON)
def acknowledge_event(body: Reason, number: Number, services: ServicesDep) -> ModelEventEntry:
    """It is closed; another one is raised when the parameter is found beyond its bounds again."""
    return services.models.history.acknowledge(number, body.reason, utc_now())
