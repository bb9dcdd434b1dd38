"""The faults of the campaign are faults."""

import random
from pathlib import Path

import pytest

from reliability.damage import damage_something
from reliability.faulty_disk import FaultyDisk, full
from reliability.ledger import Ledger
from tauscope.server.store.data_folder import FOLDERS


def test_a_step_that_was_drawn_fails_and_those_before_it_do_not(tmp_path: Path) -> None:
    disk = FaultyDisk(tmp_path)
    disk.arm(full, 1, lasts=True)
    disk._audited("os.mkdir", (str(tmp_path / "first"), 0o777, -1))
    assert not disk.is_full
    for _ in range(2):
        with pytest.raises(OSError, match="No space left"):
            disk._audited("open", (str(tmp_path / "second"), "w", 0o101))
    assert disk.is_full
    disk._audited("open", (str(tmp_path / "second"), "r", 0))
    disk._audited("os.mkdir", ("/elsewhere", 0o777, -1))


def test_damage_changes_a_file_and_is_noted_before(tmp_path: Path) -> None:
    ledger, notes = Ledger(), list[tuple[str, str]]()
    ledger.note("begin", "")
    ledger.note("taken", "job")
    file = tmp_path / FOLDERS["identification"] / "job" / "result.json"
    file.parent.mkdir(parents=True)

    def note(what: str, key: str, _: str = "") -> None:
        notes.append((what, key))

    for seed in range(30):
        file.write_bytes(b'{"made_from": []}')
        assert damage_something(tmp_path, ledger, note, random.Random(seed))
        assert file.read_bytes() != b'{"made_from": []}'
    assert notes == [("damage_job", "job")] * 30
