"""``tauscope model``: the history on the terminal, beside a service that works with the folder."""

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from cli.conftest import Ended
from identified import NOON, candidate, identified
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.store.data_folder import FolderLock
from tauscope.server.store.database.database import FILE_NAME, Database
from tauscope.server.store.database.index import Index, ItemMetadata

Run = Callable[..., Ended]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Six weeks of an arm whose viscous friction grows; the last model was refused."""
    database = Database(tmp_path / FILE_NAME)
    index = Index(database, "here")
    index.register("data", NOON)
    index.put([ItemMetadata("run", "20251103T110000Z-00000002", "finished", True, "9", NOON, robot="arm")])
    history = ModelHistory(database)
    for day, viscous in ((1, 0.5), (22, 0.6), (43, 0.7)):
        given = candidate(day, identified({"viscous": viscous}, friction__0__std__viscous=0.01))
        history.consider(given, given.created + timedelta(minutes=1))
    history.consider(candidate(44, identified(condition_number=1e4)), NOON)
    database.close()
    return tmp_path


def test_models_their_trend_and_what_drifted(run: Run, data: Path) -> None:
    lock = FolderLock(data)
    ended = run("model", "list", "arm", "--data", data)
    assert (ended.status, ended.err) == (0, "")
    assert "condition number 1e+04, allowed 500" in ended.out
    assert ended.out.count("all gates passed") == 3
    ended = run("model", "trend", "arm", "--data", data)
    (line,) = [line for line in ended.out.splitlines() if "viscous shoulder" in line]
    assert line.split()[2:6] == ["3", "0.5000", "0.7000", "0.0333"]
    ended = run("model", "events", "arm", "--data", data)
    assert ended.status == 1
    assert "shoulder: viscous friction +40 % in 6 weeks (0.5 → 0.7, 14 standard errors)" in ended.out
    assert "arm: 1 parameter drifted beyond the bounds" in ended.err
    lock.release()


def test_a_choice_by_hand(run: Run, data: Path) -> None:
    refused = candidate(44, None).identifier
    ended = run("model", "activate", refused, "--reason", "I know", "--data", data)
    assert (ended.status, ended.out.strip()) == (0, f"{refused} is the active model of arm")
    ended = run("model", "reference", refused, "--reason", "new gear", "--data", data)
    assert ended.status == 0
    assert run("model", "events", "arm", "--data", data).status == 0


def test_what_is_not_there_and_what_is_left_out(run: Run, data: Path, tmp_path: Path) -> None:
    ended = run("model", "list", "arn", "--data", data)
    assert (ended.status, len(ended.err.splitlines())) == (1, 1)
    assert "did you mean 'arm'" in ended.err
    assert run("model", "activate", "x", "--data", data).status == 2  # without a reason
    (tmp_path / "empty").mkdir()
    assert "there is no such database" in run("model", "list", "arm", "--data", tmp_path / "empty").err
