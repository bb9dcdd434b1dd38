"""Two services as they are run, each with a data folder of its own, on one PostgreSQL database."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx2
import psycopg
import pytest

from patience import eventually
from postgres import Postgres
from shared_data import REPOSITORY
from snapshots import SNAPSHOTS, unpacked

pytestmark = [pytest.mark.slow, pytest.mark.system, pytest.mark.timeout(1200)]

SCHEDULES = 30
LEAST_ROUNDS, MOST_ROUNDS = 3, 30
PATIENCE_S = 240.0


@contextmanager
def tauscope_serve(data: Path, database: str) -> Iterator[httpx2.Client]:
    """The command, and a client of what it serves."""
    words = [sys.executable, "-m", "tauscope.cli", "serve", "--port", "0", "--data", str(data)]
    environment = {**os.environ, "TAUSCOPE_DATABASE": database}
    with subprocess.Popen(words, cwd=REPOSITORY, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            told = re.match(r"Tauscope at (http://127\.0\.0\.1:\d+),", process.stdout.readline())
            assert told is not None
            with httpx2.Client(base_url=f"{told[1]}/api/v1", timeout=60) as client:
                yield client
        finally:
            process.terminate()
            process.communicate(timeout=60)


def data_folder(folder: Path) -> Path:
    """What an earlier version left, and one recording more: too short to be worked on for long."""
    folder.mkdir()
    data = unpacked(SNAPSHOTS[-1], folder)
    (data / "site.json").unlink(missing_ok=True)  # each is a folder of its own, not a copy of the other
    (data / "recordings" / "cell.csv").write_text("t,q1\n0,0\n", encoding="utf-8")
    return data


def identifications(client: httpx2.Client) -> dict[str, str]:
    answer = client.get("/identifications", params={"limit": 1000})
    return {each["id"]: each["state"] for each in answer.json()["identifications"]}


def test_each_schedule_fires_once(postgres: Postgres, tmp_path: Path) -> None:
    """All schedules become due at one moment, again and again, until both services have taken some of them on."""
    database = postgres.new_database()
    with ExitStack() as running:
        folders = [data_folder(tmp_path / name) for name in ("first", "second")]
        clients = [running.enter_context(tauscope_serve(folder, database)) for folder in folders]
        before = [identifications(client) for client in clients]
        like = next(name for name, state in before[0].items() if state == "succeeded")
        names = [f"cell-{number}" for number in range(SCHEDULES)]
        choice = {"pattern": "cell.csv", "train": 1, "held_out": 0}
        definition = {"kind": "identification", "every_s": 86_400, "recordings": choice}
        for name in names:
            answer = clients[0].put(
                f"/schedules/{name}", json={"like": like, "anywhere": True, "definition": definition}
            )
            assert answer.status_code == 200, answer.text

        def are_done(rounds: int) -> bool:
            """All that the firings of so many rounds began has ended."""
            query = {"kind": "identification", "limit": 1000}
            states = [each["state"] for each in clients[0].get("/items", params=query).json()["items"]]
            count = sum(map(len, before)) + SCHEDULES * rounds
            return len(states) >= count and not {"queued", "running"} & set(states)

        rounds = 0
        while rounds < LEAST_ROUNDS or (not all(started(clients, before)) and rounds < MOST_ROUNDS):
            for folder in folders:
                (folder / "recordings" / "cell.csv").touch()
            make_due(database)
            rounds += 1
            assert eventually(lambda rounds=rounds: are_done(rounds), PATIENCE_S)
        made = started(clients, before)
        assert all(made), f"one service did everything in {rounds} rounds"
        told = [each for name in names for each in clients[1].get(f"/schedules/{name}/firings").json()["firings"]]
        assert {each["state"] for each in told} == {"started"}
        assert len(told) == len({each["item"] for each in told}) == SCHEDULES * rounds
        assert sum(made) == SCHEDULES * rounds


def started(clients: list[httpx2.Client], before: list[dict[str, str]]) -> list[int]:
    """How many identifications each service has begun since."""
    return [len(identifications(client)) - len(old) for client, old in zip(clients, before, strict=True)]


def make_due(database: str) -> None:
    """As if a day had passed."""
    with psycopg.connect(database, autocommit=True) as connection:
        connection.execute("UPDATE schedules SET next_due = now()")
