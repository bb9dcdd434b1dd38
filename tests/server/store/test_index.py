"""The index by itself: what is put in is found, on SQLite and on PostgreSQL."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import FileMetadata, Index, ItemMetadata, ItemQuery, RecordingRole
from tauscope.server.store.database.tables import Recording
from tauscope.server.store.recordings import StoredRecording

NOON = datetime(2026, 11, 3, 12, 0, 0, tzinfo=UTC)
DIGEST = "ab" * 32
IDENTIFIED = ItemMetadata(
    kind="identification",
    identifier="20261103T120000Z-00000001",
    state="succeeded",
    is_final=True,
    stamp="1-2",
    created=NOON,
    ended=NOON + timedelta(seconds=5),
    robot="arm",
    figures={"relative_error": 0.03, "held_out_error": 0.04},
    recordings=(RecordingRole("recordings", "a.csv", "server", DIGEST),),
    artefacts=(FileMetadata("exports/friction.h", 2**33, "cd" * 32), FileMetadata("result.json", 7, DIGEST)),
)
RUN = ItemMetadata(
    "run", "20261103T110000Z-00000002", "running", False, "9", NOON - timedelta(hours=1), robot="Arm α/β"
)


@pytest.fixture
def index(database: Database) -> Index:
    made = Index(database, "here")
    made.register("data", NOON)
    return made


def identifiers(index: Index, **query: object) -> list[str]:
    return [entry.identifier for entry in index.search(ItemQuery(**query))]  # pyright: ignore[reportArgumentType]


def test_what_is_put_in_is_found_as_it_was(index: Index) -> None:
    index.put([IDENTIFIED])
    (found,) = index.search(ItemQuery())
    assert (found.kind, found.identifier, found.site) == ("identification", IDENTIFIED.identifier, "here")
    assert (found.state, found.robot, found.created, found.ended) == ("succeeded", "arm", NOON, IDENTIFIED.ended)
    assert found.figures == {"relative_error": 0.03, "held_out_error": 0.04}
    assert index.artefacts("identification", IDENTIFIED.identifier) == IDENTIFIED.artefacts
    assert index.stamps("identification") == {IDENTIFIED.identifier: ("1-2", True)}
    assert index.stamps("run") == {}


def test_putting_again_replaces(index: Index) -> None:
    index.put([IDENTIFIED])
    changed = replace(IDENTIFIED, state="damaged", problem=("damaged", "gone"), artefacts=(), recordings=(), figures={})
    index.put([changed])
    (found,) = index.search(ItemQuery())
    assert (found.state, found.problem_code, found.problem_detail) == ("damaged", "damaged", "gone")
    assert found.figures == {"relative_error": None, "held_out_error": None}
    assert index.artefacts("identification", IDENTIFIED.identifier) == ()
    assert identifiers(index, recording_sha256=DIGEST) == []


def test_searches(index: Index) -> None:
    index.put([IDENTIFIED])
    index.put([RUN])
    assert identifiers(index) == [IDENTIFIED.identifier, RUN.identifier]
    assert identifiers(index, kind="run") == [RUN.identifier]
    assert identifiers(index, robot="Arm α/β") == [RUN.identifier]
    assert identifiers(index, state="succeeded") == [IDENTIFIED.identifier]
    assert identifiers(index, recording_sha256=DIGEST) == [IDENTIFIED.identifier]
    assert identifiers(index, before=NOON) == [RUN.identifier]
    assert identifiers(index, limit=1) == [IDENTIFIED.identifier]
    assert identifiers(index, site="elsewhere") == []
    assert [(robot.name, robot.first_seen) for robot in index.robots()] == [("Arm α/β", RUN.created), ("arm", NOON)]


def test_two_sites_of_one_database(index: Index, database: Database) -> None:
    other = Index(database, "elsewhere")
    other.register("data", NOON)
    index.put([IDENTIFIED])
    other.put([replace(IDENTIFIED, robot="arm", created=NOON + timedelta(days=1))])
    assert [entry.site for entry in index.search(ItemQuery())] == ["elsewhere", "here"]
    other.forget("identification", [IDENTIFIED.identifier])
    assert [entry.site for entry in index.search(ItemQuery())] == ["here"]
    assert index.artefacts("identification", IDENTIFIED.identifier) == IDENTIFIED.artefacts
    (robot,) = index.robots()
    assert (robot.first_seen, robot.last_seen) == (NOON, NOON + timedelta(days=1))


def test_recordings_come_and_go(index: Index, database: Database) -> None:
    entry = StoredRecording("a.csv", 3 * 2**32, NOON, DIGEST)
    index.put_recordings([entry, StoredRecording("b.csv", 1, NOON, None)])
    index.put_recordings([replace(entry, size=5)])
    with database.reading() as session:
        assert [(row.name, row.size, row.sha256) for row in session.query(Recording)] == [("a.csv", 5, DIGEST)]
