"""Judging one identification within a transaction: its gates, its place, and what has drifted since the reference."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta

from pydantic import ValidationError
from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import Drift, compute_drift, describe_drift, extract_parameters, is_beyond
from tauscope.server.history.gates import Gate, ModelPolicy, check_gates, passes
from tauscope.server.store.database.tables import Model, ModelChoice, ModelEvent, Robot


@dataclass(frozen=True)
class Candidate:
    """An identification that is to be judged.

    result : bytes or None
        its document; None where it cannot be read
    """

    identifier: str
    site: str
    robot: str
    created: datetime
    source: str
    result: bytes | None


def judge(session: Session, robot: Robot, candidate: Candidate, policy: ModelPolicy, now: datetime) -> Model:
    """Judge an identification, and write down what came of it."""
    document = _parse(candidate.result)
    active, reference = _current(session, robot, is_active=True), _current(session, robot, is_active=False)
    model = Model(
        robot=robot,
        site=candidate.site,
        identifier=candidate.identifier,
        created=candidate.created,
        considered=now,
        source=candidate.source,
        state="unreadable",
        gates=[],
        is_active=False,
        is_reference=False,
        document=None if document is None else json.loads(document.model_dump_json(by_alias=True)),
    )
    session.add(model)
    if document is not None:
        gates = (*check_gates(document, policy, _document(active)), *_check_place(candidate, active))
        model.gates, model.state = [asdict(gate) for gate in gates], "refused"
        if passes(gates):
            choose(session, model, "active", "all gates passed", now)
            if reference is None:
                choose(session, model, "reference", "the first model that passed", now)
            else:
                _raise_drift_events(session, reference, model, document, policy, now)
    return model


def choose(session: Session, model: Model, role: str, reason: str, now: datetime) -> None:
    """Make a model the active one, or the reference; the one before is kept."""
    session.flush()
    column = Model.is_active if role == "active" else Model.is_reference
    for other in session.scalars(select(Model).where(Model.robot_id == model.robot_id, column, Model.id != model.id)):
        if role == "active":
            other.is_active, other.state = False, "kept"
        else:
            other.is_reference = False
    session.flush()  # at no moment are there two
    if role == "active":
        model.is_active, model.state = True, "active"
    else:
        model.is_reference = True
        for event in session.scalars(_open_drifts(model.robot_id)):
            event.closed, event.note = now, f"model {model.identifier} became the reference: {reason}"
    session.add(ModelChoice(robot_id=model.robot_id, model_id=model.id, role=role, at=now, reason=reason))


def compare_models(before: IdentificationDocument, after: IdentificationDocument) -> tuple[Drift, ...]:
    """The change of every parameter that two models tell."""
    return compute_drift(extract_parameters(before), extract_parameters(after))


def _check_place(candidate: Candidate, active: Model | None) -> Sequence[Gate]:
    """A model takes the place of an older one of the same arm only."""
    if active is None:
        return ()
    is_newer = candidate.created >= active.created
    reason = "handed in after the active model" if is_newer else "older than the active model; activate it by hand"
    gates = [Gate("newer", is_newer, reason)]
    is_other = candidate.source == "simulated" and active.source != "simulated"
    reason = "recorded on a simulated arm, the active model was not; activate it by hand if that is meant"
    gates.append(Gate("source", not is_other, reason if is_other else f"{candidate.source} recordings"))
    return gates


def _raise_drift_events(
    session: Session,
    reference: Model,
    model: Model,
    document: IdentificationDocument,
    policy: ModelPolicy,
    now: datetime,
) -> None:
    """Raise an event for each parameter that has left its bounds; one that is open already is brought up to date."""
    before = _document(reference)
    if before is None:
        return
    elapsed = max(model.created - reference.created, timedelta(0))
    present = {event.parameter: event for event in session.scalars(_open_drifts(model.robot_id))}
    for drift in compare_models(before, document):
        if not is_beyond(drift, policy):
            continue
        details = {**asdict(drift), "reference": reference.identifier, "model": model.identifier}
        event = present.get(drift.name)
        if event is None:
            event = ModelEvent(
                robot_id=model.robot_id, kind="drift", parameter=drift.name, raised=now, text="", details={}
            )
            session.add(event)
        event.text, event.details, event.last_seen = describe_drift(drift, elapsed), details, now


def _open_drifts(robot_id: int):
    """The drifts of a robot that nobody has taken note of."""
    return select(ModelEvent).where(
        ModelEvent.robot_id == robot_id, ModelEvent.kind == "drift", ModelEvent.closed.is_(None)
    )


def _current(session: Session, robot: Robot, *, is_active: bool) -> Model | None:
    """The active model of a robot, or its reference."""
    column = Model.is_active if is_active else Model.is_reference
    return session.scalar(select(Model).options(undefer(Model.document)).where(Model.robot_id == robot.id, column))


def _document(model: Model | None) -> IdentificationDocument | None:
    """What a model says."""
    return None if model is None or model.document is None else IdentificationDocument.model_validate(model.document)


def _parse(result: bytes | None) -> IdentificationDocument | None:
    """The document of a result; None where it is none."""
    try:
        return None if result is None else IdentificationDocument.model_validate_json(result)
    except ValidationError:
        return None
