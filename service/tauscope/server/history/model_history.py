"""The history of models: every identification is judged once, and at most one model of a robot is active."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from pydantic import Field
from sqlalchemy import select
from sqlalchemy.orm import Session, aliased, undefer

from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.robot.messages import nearest, shown
from tauscope.server.history.gates import Gate, ModelPolicy
from tauscope.server.history.model_judgement import Candidate, choose, judge
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.tables import Item, Model, ModelEvent, Robot, RobotPolicy
from tauscope.strict_model import entry, take_fields


@dataclass(frozen=True)
class ModelEntry:
    identifier: str
    site: str
    robot: str
    created: datetime
    considered: datetime
    source: str
    state: str
    gates: tuple[Gate, ...]
    is_reference: bool


@entry
class ModelEventEntry:
    number: int = Field(description="of the event")
    robot: str = Field(description="name of the robot")
    kind: str = Field(description="drift", examples=["drift"])
    parameter: str = Field(description="that drifted")
    text: str = Field(description="one line", examples=["joint3: viscous friction +40 % in 6 weeks"])
    details: Mapping[str, Any] = Field(exclude=True)
    raised: datetime = Field(description="when it was seen first, UTC")
    last_seen: datetime = Field(description="when it was seen last, UTC")
    closed: datetime | None = Field(description="when somebody took note, UTC")
    note: str | None = Field(description="what they wrote")


class ModelHistory:
    """Models of every robot. Every method is one short transaction, and may be called from any thread."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def list_unjudged(self, site: str) -> list[str]:
        """Identifications that succeeded and were not judged yet, the oldest first."""
        judged = select(Model.identifier).where(Model.site == site)
        query = (
            select(Item.identifier)
            .where(Item.site == site, Item.kind == "identification", Item.state == "succeeded")
            .where(Item.robot_id.is_not(None), Item.identifier.not_in(judged))
            .order_by(Item.created)
        )
        return self._database.fetch(query)

    def consider(self, candidate: Candidate, now: datetime) -> ModelEntry:
        """Judge an identification. Raises NotFoundError without its robot, IntegrityError if it was judged already."""
        with self._database.writing() as session:
            robot = _robot(session, candidate.robot)
            return _entry(judge(session, robot, candidate, _policy(session, robot), now))

    def activate(self, identifier: str, role: str, reason: str, now: datetime) -> ModelEntry:
        """Make a model active, or the reference. Raises NotFoundError if there is none, or it is unreadable."""
        with self._database.writing() as session:
            model = _model(session, identifier)
            if model.state == "unreadable":
                raise NotFoundError(f"model {identifier}: its result could not be read; choose another one")
            session.execute(select(Robot.id).where(Robot.id == model.robot_id).with_for_update())
            choose(session, model, role, reason, now)
            return _entry(model)

    def list_protected(self) -> frozenset[str]:
        """Identifiers of the models that are active, or that drift is counted from."""
        return frozenset(self._database.fetch(select(Model.identifier).where(Model.is_active | Model.is_reference)))

    def find(self, identifier: str) -> ModelEntry:
        with self._database.reading() as session:
            return _entry(_model(session, identifier))

    def document(self, identifier: str) -> IdentificationDocument:
        """What a model says, also where its identification was removed. Raises NotFoundError without it."""
        with self._database.reading() as session:
            content = _model(session, identifier).document
        if content is None:
            raise NotFoundError(f"model {identifier}: its result could not be read; choose another one")
        return IdentificationDocument.model_validate(content)

    def active(self, robot: str) -> ModelEntry | None:
        query = select(Model).join(Robot).where(Robot.name == robot, Model.is_active)
        return next(map(_entry, self._database.fetch(query)), None)

    def active_and_reference(self, site: str) -> dict[str, tuple[str, str]]:
        """Identifiers of the active model and of the one that drift is counted from, by name of the robot."""
        active, reference = aliased(Model), aliased(Model)
        query = (
            select(Robot.name, active.identifier, reference.identifier)
            .join(active, (active.robot_id == Robot.id) & active.is_active & (active.site == site))
            .join(reference, (reference.robot_id == Robot.id) & reference.is_reference)
        )
        with self._database.reading() as session:
            return {name: (now, then) for name, now, then in session.execute(query)}

    def models(self, robot: str | None, limit: int) -> list[ModelEntry]:
        query = select(Model).join(Robot).order_by(Model.created.desc(), Model.id.desc()).limit(limit)
        if robot is not None:
            query = query.where(Robot.name == robot)
        return [_entry(model) for model in self._database.fetch(query)]

    def documents(self, robot: str) -> list[tuple[str, datetime, IdentificationDocument]]:
        """Models that were ever active, the oldest first. Raises NotFoundError if there is no such robot."""
        query = select(Model).options(undefer(Model.document)).where(Model.state.in_(("active", "kept")))
        with self._database.reading() as session:
            models = session.scalars(query.where(Model.robot == _robot(session, robot)).order_by(Model.created))
            return [
                (each.identifier, each.created, IdentificationDocument.model_validate(each.document)) for each in models
            ]

    def policy(self, robot: str) -> ModelPolicy:
        """The bounds for a robot. Raises NotFoundError if there is no such robot."""
        with self._database.reading() as session:
            return _policy(session, _robot(session, robot))

    def set_policy(self, robot: str, policy: ModelPolicy) -> None:
        """Set the bounds for models that are judged from now on. Raises NotFoundError without the robot."""
        with self._database.writing() as session:
            session.merge(RobotPolicy(robot_id=_robot(session, robot).id, document=policy.model_dump()))

    def events(self, robot: str | None, *, only_open: bool, limit: int) -> list[ModelEventEntry]:
        query = select(ModelEvent).join(Robot).order_by(ModelEvent.last_seen.desc(), ModelEvent.id.desc()).limit(limit)
        if robot is not None:
            query = query.where(Robot.name == robot)
        if only_open:
            query = query.where(ModelEvent.closed.is_(None))
        return [_event(event) for event in self._database.fetch(query)]

    def acknowledge(self, number: int, note: str, now: datetime) -> ModelEventEntry:
        """Close an event, unless it is closed. Raises NotFoundError if there is no such event."""
        with self._database.writing() as session:
            event = session.get(ModelEvent, number)
            if event is None:
                raise NotFoundError(f"there is no event {number}; list the events")
            if event.closed is None:
                event.closed, event.note = now, note
            return _event(event)


def _robot(session: Session, name: str) -> Robot:
    """The row of a robot; locked until the transaction ends where the database can lock rows."""
    robot = session.scalar(select(Robot).where(Robot.name == name).with_for_update(of=Robot))
    if robot is None:
        known = session.scalars(select(Robot.name).order_by(Robot.name).limit(1000)).all()
        hint = nearest(name, known) if known else "identify one first"
        raise NotFoundError(f"nothing is kept about a robot {shown(name)}; {hint}")
    return robot


def _policy(session: Session, robot: Robot) -> ModelPolicy:
    row = session.get(RobotPolicy, robot.id)
    return ModelPolicy() if row is None else ModelPolicy.model_validate(row.document)


def _model(session: Session, identifier: str) -> Model:
    model = session.scalars(select(Model).where(Model.identifier == identifier).limit(1)).first()
    if model is None:
        hint = "list the models; an identification is judged within seconds of its end"
        raise NotFoundError(f"no model {shown(identifier)} is kept here; {hint}")
    return model


def _entry(model: Model) -> ModelEntry:
    gates = tuple(Gate(**gate) for gate in model.gates)
    return take_fields(ModelEntry, model, robot=model.robot.name, gates=gates)


def _event(event: ModelEvent) -> ModelEventEntry:
    return take_fields(ModelEventEntry, event, number=event.id, robot=event.robot.name)
