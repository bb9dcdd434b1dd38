"""The history of models on both databases: who is active, who stays, and what is told."""

import json
import threading
from dataclasses import replace
from datetime import timedelta

import pytest
from sqlalchemy import select, update
from sqlalchemy.exc import IntegrityError

from identified import NOON, candidate, identified
from tauscope.errors import NotFoundError
from tauscope.identification import IdentificationDocument
from tauscope.server.history.gates import ModelPolicy
from tauscope.server.history.model_history import ModelEntry, ModelHistory
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import Index, ItemMetadata
from tauscope.server.store.database.tables import Model, ModelChoice


@pytest.fixture
def history(database: Database) -> ModelHistory:
    """Of one arm, about which something is kept already."""
    index = Index(database, "here")
    index.register("data", NOON)
    index.put([ItemMetadata("run", "20251103T110000Z-00000002", "finished", True, "9", NOON, robot="arm")])
    return ModelHistory(database)


def consider(history: ModelHistory, day: int, document: IdentificationDocument | None, **changes: object) -> ModelEntry:
    given = candidate(day, document, **changes)
    return history.consider(given, given.created + timedelta(minutes=1))


def states(history: ModelHistory) -> list[str]:
    return [entry.state for entry in history.models("arm", 100)][::-1]


def viscous(value: float) -> IdentificationDocument:
    return identified({"viscous": value}, friction__0__std__viscous=0.01)


def test_the_first_that_passes_is_active_and_the_next_one_takes_its_place(history: ModelHistory) -> None:
    first = consider(history, 1, identified())
    assert (first.state, first.is_reference) == ("active", True)
    second = consider(history, 2, identified())
    assert (second.state, second.is_reference) == ("active", False)
    assert states(history) == ["kept", "active"]
    active = history.active("arm")
    assert active is not None
    assert active.identifier == second.identifier
    assert history.document(first.identifier) == identified()


def test_one_that_does_not_pass_changes_nothing(history: ModelHistory) -> None:
    first = consider(history, 1, identified(fit__held_out=None))
    assert first.state == "refused"
    assert [gate.name for gate in first.gates if not gate.passed] == ["held_out"]
    assert history.active("arm") is None
    consider(history, 2, identified())
    consider(history, 3, identified(condition_number=1e4))
    consider(history, 4, viscous(9.0).model_copy(update={"undetermined": ["Iyy1"]}))
    assert states(history) == ["refused", "active", "refused", "refused"]
    assert history.events("arm", only_open=False, limit=10) == []


def diagnosis(after: float, shift_in_std: float, *effects: str) -> bytes:
    """A diagnosis of the same recordings: its findings move the viscous friction from 1."""
    shift = {"parameter": "viscous shoulder", "before": 1.0, "after": after, "shift_in_std": shift_in_std}
    findings = [{"effect": effect, "joint": "shoulder", "probability": 0.9} for effect in effects]
    return json.dumps({"verdict": "explained", "findings": findings, "parameter_shifts": [shift]}).encode()


def test_one_that_its_own_diagnosis_contradicts_is_neither_active_nor_the_reference(history: ModelHistory) -> None:
    contradicted = consider(history, 1, viscous(1.0), diagnosis=diagnosis(0.2, -80.0, "joint_spring"))
    assert (contradicted.state, contradicted.is_reference) == ("refused", False)
    (closed,) = [gate for gate in contradicted.gates if not gate.passed]
    assert closed.name == "diagnosis"
    assert "joint_spring at shoulder, which moves viscous shoulder by 80 standard errors" in closed.reason
    assert history.active("arm") is None
    small = consider(history, 2, viscous(1.0), diagnosis=diagnosis(1.02, 80.0, "joint_spring"))
    assert (small.state, small.is_reference) == ("active", True)  # far in standard errors, and little in size
    assert consider(history, 3, viscous(1.0), diagnosis=diagnosis(0.2, -3.0, "joint_spring")).state == "active"
    assert consider(history, 4, viscous(1.0), diagnosis=diagnosis(0.2, -80.0)).state == "active"
    assert consider(history, 5, viscous(1.0), diagnosis=b"{}").state == "active"  # of another version


def test_an_older_one_and_a_simulated_one_never_replace_what_an_arm_said(history: ModelHistory) -> None:
    consider(history, 5, identified())
    older = consider(history, 4, identified())
    simulated = consider(history, 6, identified(), source="simulated")
    assert [gate.name for gate in older.gates if not gate.passed] == ["newer"]
    assert [gate.name for gate in simulated.gates if not gate.passed] == ["source"]
    assert states(history) == ["refused", "active", "refused"]


def test_slow_drift_is_counted_from_the_reference_and_told_once(history: ModelHistory) -> None:
    """Every week 4 % more: no model differs much from the one before, and all of them pass."""
    for week in range(10):
        entry = consider(history, 1 + 7 * week, viscous(0.5 * (1 + 0.05 * week)))
        assert entry.state == "active"
        told = [event.text for event in history.events("arm", only_open=True, limit=10)]
        assert len(told) == (1 if week > 5 else 0), week
    (event,) = history.events("arm", only_open=True, limit=10)
    assert event.text == "shoulder: viscous friction +45 % in 2 months (0.5 → 0.725, 16 standard errors)"
    assert event.parameter == "viscous shoulder"
    assert event.last_seen - event.raised == timedelta(weeks=3)
    assert event.details["share"] == pytest.approx(0.45)


def test_taking_note_closes_and_a_new_reference_begins_anew(history: ModelHistory) -> None:
    consider(history, 1, viscous(0.5))
    second = consider(history, 8, viscous(0.8))
    (event,) = history.events("arm", only_open=True, limit=10)
    closed = history.acknowledge(event.number, "we know", NOON)
    assert (closed.closed, closed.note) == (NOON, "we know")
    consider(history, 9, viscous(0.8))
    assert len(history.events("arm", only_open=True, limit=10)) == 1
    history.activate(second.identifier, "reference", "new grease", NOON)
    assert history.events("arm", only_open=True, limit=10) == []
    consider(history, 10, viscous(0.8))
    assert history.events("arm", only_open=True, limit=10) == []
    consider(history, 11, viscous(0.5))
    (event,) = history.events("arm", only_open=True, limit=10)
    assert event.text.startswith("shoulder: viscous friction -38 % in 3 days")


def test_somebody_may_choose_and_the_choice_is_kept_with_its_reason(history: ModelHistory, database: Database) -> None:
    first = consider(history, 1, identified())
    consider(history, 2, identified())
    refused = consider(history, 3, identified(condition_number=1e4))
    assert history.activate(refused.identifier, "active", "I know better", NOON).state == "active"
    assert history.activate(first.identifier, "active", "no, I do not", NOON).state == "active"
    assert states(history) == ["active", "kept", "kept"]
    with database.reading() as session:
        reasons = session.scalars(select(ModelChoice.reason).order_by(ModelChoice.id)).all()
    assert reasons == [
        "all gates passed",
        "the first model that passed",
        "all gates passed",
        "I know better",
        "no, I do not",
    ]


def test_a_result_that_cannot_be_read_is_said_to_be_so_once(history: ModelHistory) -> None:
    entry = consider(history, 1, None)
    broken = history.consider(replace(candidate(2, None), result=b'{"schema": "tauscope.identification/1"}'), NOON)
    assert (entry.state, broken.state) == ("unreadable", "unreadable")
    with pytest.raises(NotFoundError, match="could not be read"):
        history.document(entry.identifier)
    with pytest.raises(NotFoundError, match="could not be read"):
        history.activate(entry.identifier, "active", "", NOON)


def test_an_identification_is_judged_once(history: ModelHistory) -> None:
    consider(history, 1, identified())
    with pytest.raises(IntegrityError):
        consider(history, 1, identified())
    assert states(history) == ["active"]


def test_the_database_itself_allows_one_active_model_of_a_robot(history: ModelHistory, database: Database) -> None:
    consider(history, 1, identified())
    consider(history, 2, identified())
    with pytest.raises(IntegrityError), database.writing() as session:
        session.execute(update(Model).values(is_active=True))


def test_racing_judges_leave_one_active_model(history: ModelHistory) -> None:
    failures: list[BaseException] = []

    def consider_some(start: int) -> None:
        try:
            for day in range(start, start + 40, 4):
                consider(history, day, identified())
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=consider_some, args=(start,)) for start in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    found = states(history)
    assert len(found) == 40
    assert found.count("active") == 1
    assert found[-1] == "active"  # the newest passes whoever came before it


def test_the_bounds_of_a_robot(history: ModelHistory) -> None:
    assert history.policy("arm") == ModelPolicy()
    strict = ModelPolicy(condition_number=1.5, drift_share=0.01)
    for _ in range(2):
        history.set_policy("arm", strict)
    assert history.policy("arm") == strict
    assert consider(history, 1, identified()).state == "refused"


def test_what_is_not_there(history: ModelHistory) -> None:
    with pytest.raises(NotFoundError, match="'arn'; did you mean 'arm'"):
        history.policy("arn")
    with pytest.raises(NotFoundError, match="no model 'x' is kept here"):
        history.find("x")
    with pytest.raises(NotFoundError, match="no event 7"):
        history.acknowledge(7, "", NOON)
    assert history.active("arm") is None
    assert history.documents("arm") == []
