"""Judging one identification within a transaction: its gates, its place, and what has drifted since the reference."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from tauscope.identification import IdentificationDocument
from tauscope.server.history.drift import Drift, compute_drift, describe_drift, extract_parameters, is_beyond
from tauscope.server.history.gates import Gate, ModelPolicy, check_gates, passes
from tauscope.server.store.database.tables import Model, ModelChoice, ModelEvent, Robot

Document = TypeVar("Document", bound=BaseModel)


class NamedFinding(BaseModel):
    effect: str
    joint: str | None


class ParameterShift(BaseModel):
    """The change of a parameter when the findings are added, values in SI."""

    parameter: str
    before: float
    after: float
    shift_in_std: float


class OwnDiagnosis(BaseModel):
    verdict: str
    findings: list[NamedFinding]
    parameter_shifts: list[ParameterShift]


@dataclass(frozen=True)
class Candidate:
    """`result` and `diagnosis` of the same recordings: their documents, None where there is none to be read."""

    identifier: str
    site: str
    robot: str
    created: datetime
    source: str
    result: bytes | None
    diagnosis: bytes | None = None


def judge(session: Session, robot: Robot, candidate: Candidate, policy: ModelPolicy, now: datetime) -> Model:
    document = _parse(candidate.result, IdentificationDocument)
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
        gates += tuple(_check_diagnosis(candidate.diagnosis, document, policy))
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


def _check_diagnosis(content: bytes | None, document: IdentificationDocument, policy: ModelPolicy) -> Iterator[Gate]:
    """A parameter that the diagnosis' findings move by as much as counts as drift is wrong in the model."""
    diagnosis = _parse(content, OwnDiagnosis)
    if diagnosis is None:
        return
    scales = {parameter.name: parameter.scale for parameter in extract_parameters(document)}
    moved = [
        shift
        for shift in diagnosis.parameter_shifts
        if abs(shift.shift_in_std) > policy.drift_std
        and abs(shift.after - shift.before) > policy.drift_share * scales.get(shift.parameter, math.inf)
    ]
    if not diagnosis.findings or not moved:
        yield Gate("diagnosis", True, f"its diagnosis is {diagnosis.verdict}, and moves no parameter beyond its bounds")
        return
    worst, finding = max(moved, key=lambda shift: abs(shift.shift_in_std)), diagnosis.findings[0]
    place = f" at {finding.joint}" if finding.joint else ""
    reason = (
        f"its diagnosis names {finding.effect}{place}, which moves {worst.parameter} by"
        f" {abs(worst.shift_in_std):.0f} standard errors; add it to the model, or activate this one by hand"
    )
    yield Gate("diagnosis", False, reason)


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
    return select(ModelEvent).where(
        ModelEvent.robot_id == robot_id, ModelEvent.kind == "drift", ModelEvent.closed.is_(None)
    )


def _current(session: Session, robot: Robot, *, is_active: bool) -> Model | None:
    column = Model.is_active if is_active else Model.is_reference
    return session.scalar(select(Model).options(undefer(Model.document)).where(Model.robot_id == robot.id, column))


def _document(model: Model | None) -> IdentificationDocument | None:
    return None if model is None or model.document is None else IdentificationDocument.model_validate(model.document)


def _parse(result: bytes | None, kind: type[Document]) -> Document | None:
    """The document of a result; None where it is none."""
    try:
        return None if result is None else kind.model_validate_json(result)
    except ValidationError:
        return None
