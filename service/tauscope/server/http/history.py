"""Models over HTTP: their history, gates, trends, policies and events."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import Drift, ParameterTrend, find_largest_by_joint, parameter_trends
from tauscope.server.history.gates import Gate, ModelPolicy
from tauscope.server.history.model_history import ModelEntry, ModelEventEntry
from tauscope.server.history.model_judgement import compare_models
from tauscope.server.http.answers import ROOT, AnswerModel, Identifier, Limit
from tauscope.server.http.bodies import read_document
from tauscope.server.http.openapi import json_request
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import problem_responses
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
_REASON = {"why": ("Why", {"reason": "gear oil changed on 3 November"})}
_BODY_PROBLEMS = problem_responses("bad-request", "limit-exceeded", "media-type", "not-found")
_WITH_REASON: Any = {"responses": _BODY_PROBLEMS, "openapi_extra": json_request(ReasonRequest, _REASON)}


@router.get("/models", summary="List models")
def list_models(services: ServicesDep, robot: AnyRobot = None, limit: Limit = 100) -> ModelListAnswer:
    """Every identification that was judged: the active one of each robot, those that were, those that were refused."""
    _bring_up_to_date(services)
    entries = services.models.history.models(robot, limit)
    return ModelListAnswer(models=[make_model_answer(entry) for entry in entries])


@router.get("/models/{identifier}", summary="Look a model up", responses=problem_responses("not-found"))
def get_model(identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """Its state and the gates that it had to pass; the identifier is the identification's."""
    _bring_up_to_date(services)
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
async def activate_model(request: Request, identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """Also one that was refused; the one before is kept. The reason is kept with the choice."""
    return await _choose(request, identifier, services, "active")


@router.post("/models/{identifier}/make-reference", summary="Count drift from a model", **_WITH_REASON)
async def make_reference(request: Request, identifier: Identifier, services: ServicesDep) -> ModelAnswer:
    """After maintenance, say; drifts that are open are closed."""
    return await _choose(request, identifier, services, "reference")


@router.get("/trend", summary="Follow the parameters of a robot", responses=problem_responses("not-found"))
def get_trend(services: ServicesDep, robot: RobotName) -> TrendAnswer:
    """Every parameter in every model that was ever active, and the straight line through it."""
    _bring_up_to_date(services)
    return TrendAnswer(robot=robot, parameters=parameter_trends(services.models.history.documents(robot)))


@router.get("/model-policy", summary="Look up the bounds of a robot", responses=problem_responses("not-found"))
def get_policy(services: ServicesDep, robot: RobotName) -> ModelPolicy:
    """By which its new models are judged, and beyond which a drift is told."""
    return services.models.history.policy(robot)


@router.put(
    "/model-policy",
    summary="Set the bounds of a robot",
    responses=_BODY_PROBLEMS,
    openapi_extra=json_request(ModelPolicy, {"drift": ("Tell smaller changes", {"drift_share": 0.1, "drift_std": 5})}),
)
async def set_policy(request: Request, services: ServicesDep, robot: RobotName) -> ModelPolicy:
    """They hold for models that are judged from now on; what is left out takes its default."""
    policy = await read_document(request, ModelPolicy, services.settings.max_document_bytes)
    await run_in_threadpool(services.models.history.set_policy, robot, policy)
    return policy


@router.get("/events", summary="Read what people should know")
def list_events(
    services: ServicesDep,
    robot: AnyRobot = None,
    only_open: Annotated[bool, Query(alias="open", description="only what nobody has taken note of")] = False,
    limit: Limit = 100,
) -> EventListAnswer:
    """Parameters that have drifted beyond the bounds; one event for each, brought up to date while it is open."""
    _bring_up_to_date(services)
    return EventListAnswer(events=services.models.history.events(robot, only_open=only_open, limit=limit))


@router.post("/events/{number}/acknowledge", summary="Take note of an event", **_WITH_REASON)
async def acknowledge_event(request: Request, number: Number, services: ServicesDep) -> ModelEventEntry:
    """It is closed; another one is raised when the parameter is found beyond its bounds again."""
    body = await read_document(request, ReasonRequest, services.settings.max_document_bytes)
    history, now = services.models.history, datetime.now(UTC)
    return await run_in_threadpool(history.acknowledge, number, body.reason, now)


async def _choose(request: Request, identifier: str, services: Services, role: str) -> ModelAnswer:
    body = await read_document(request, ReasonRequest, services.settings.max_document_bytes)
    history, now = services.models.history, datetime.now(UTC)
    entry = await run_in_threadpool(history.activate, identifier, role, body.reason, now)
    return make_model_answer(entry)


def _bring_up_to_date(services: Services) -> None:
    services.index.refresh()
    services.models.judge_new()
