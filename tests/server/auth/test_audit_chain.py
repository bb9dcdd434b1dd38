"""The audit log: chained, shared by processes, and every kind of tampering is found."""

import fcntl
import json
import multiprocessing
import os
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.cli.program import main
from tauscope.errors import NotFoundError
from tauscope.server.auth.audit_log import AUDIT_FILE, GENESIS, AuditLog, AuditTrail, chain_line, verify_lines

NOW = datetime(2026, 11, 22, tzinfo=UTC)


def written(folder: Path, entries: int = 6) -> AuditLog:
    log = AuditLog(folder, clock=lambda: NOW)
    for number in range(entries):
        log.append("ann", "POST /api/v1/runs", status=202, number_of_try=number, nothing=None)
    return log


def lines_of(log: AuditLog) -> list[bytes]:
    return log.path.read_bytes().splitlines(keepends=True)


def test_entries_are_chained(tmp_path: Path) -> None:
    log = written(tmp_path)
    entries = [json.loads(line) for line in lines_of(log)]
    assert [entry["number"] for entry in entries] == [1, 2, 3, 4, 5, 6]
    assert [entry["previous"] for entry in entries] == [GENESIS, *(entry["hash"] for entry in entries[:-1])]
    assert "nothing" not in entries[0]
    found = log.verify()
    assert (found.entries, found.head, found.fault) == (6, entries[-1]["hash"], None)
    assert log.path.stat().st_mode & 0o777 == 0o600


def test_the_hash_is_what_anybody_can_compute(tmp_path: Path) -> None:
    import hashlib

    entry = json.loads(lines_of(written(tmp_path, 1))[0])
    claimed = entry.pop("hash")
    text = json.dumps(entry, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert hashlib.sha256(text.encode()).hexdigest() == claimed


@given(place=st.integers(0, 5), position=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_every_changed_bit_is_found(place: int, position: int, bit: int) -> None:
    lines, entry = [], None
    for number in range(6):
        line = chain_line(entry, {"actor": "ann", "action": f"act {number}"})
        entry = json.loads(line)
        lines.append(line + b"\n")
    assert verify_lines(lines).fault is None
    changed = bytearray(lines[place])
    changed[position % (len(changed) - 1)] ^= 1 << bit
    lines[place] = bytes(changed)
    # A changed byte may be a line's end: the file's lines count, not ours.
    found = verify_lines(b"".join(lines).splitlines(keepends=True))
    assert found.fault is not None or found.entries < 6


@pytest.mark.parametrize(
    "tamper",
    [
        lambda lines: lines[1:],
        lambda lines: lines[:2] + lines[3:],
        lambda lines: [*lines[:2], lines[3], lines[2], *lines[4:]],
        lambda lines: lines[:3] + lines[2:],
        lambda lines: [*lines[:2], b"\n", *lines[2:]],
        lambda lines: [*lines[:2], b"garbage\n", *lines[2:]],
        lambda lines: [*lines[:2], b"{}\n", *lines[2:]],
        lambda lines: [*lines[:-1], lines[-1][:-20]],
        lambda lines: [*lines[:2], lines[2].replace(b'"ann"', b'"bob"'), *lines[3:]],
    ],
    ids=["first-gone", "one-gone", "swapped", "doubled", "blank", "garbage", "empty-object", "cut", "renamed"],
)
def test_tampering_is_found_and_the_command_says_so(tamper, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = written(tmp_path)
    assert main(["audit", "verify", "--data", str(tmp_path)]) == 0
    assert "6 entries" in capsys.readouterr().out
    log.path.write_bytes(b"".join(tamper(lines_of(log))))
    assert log.verify().fault is not None
    assert main(["audit", "verify", "--data", str(tmp_path)]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_log_that_was_cut_or_written_anew_is_found_by_a_noted_hash(tmp_path: Path) -> None:
    log = written(tmp_path)
    head = log.verify().head
    assert log.verify(head).fault is None
    assert main(["audit", "verify", "--data", str(tmp_path), "--head", str(head)]) == 0
    log.path.write_bytes(b"".join(lines_of(log)[:-2]))
    assert log.verify().fault is None
    assert "cut or written anew" in str(log.verify(head).fault)
    assert main(["audit", "verify", "--data", str(tmp_path), "--head", str(head)]) == 1


@pytest.mark.parametrize("kept", [1, 40, 100])
def test_a_line_that_a_crash_cut_off_is_told_by_the_next_one(kept: int, tmp_path: Path) -> None:
    log = written(tmp_path)
    *whole, last = lines_of(log)
    log.path.write_bytes(b"".join(whole) + last[:kept])
    assert "cut off" in str(log.verify().fault)
    log.append("ann", "next")
    found = log.verify()
    assert (found.entries, found.fault) == (6, None)
    assert json.loads(lines_of(log)[-1])["torn_bytes"] == kept
    lines = lines_of(log)
    log.path.write_bytes(b"".join([*lines[:-2], lines[-2][:-1] + b"x\n", lines[-1]]))
    assert log.verify().fault is not None


def _append_many(folder: str) -> None:
    for _ in range(25):
        AuditLog(Path(folder)).append("ann", "act")


def test_processes_share_one_chain(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=_append_many, args=(str(tmp_path),)) for _ in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    found = AuditLog(tmp_path).verify()
    assert (found.entries, found.fault) == (100, None)


def test_a_process_forked_in_the_middle_does_not_keep_the_log_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inherited: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: inherited.append(os.dup(descriptor)))
    log = AuditLog(tmp_path)
    log.append("ann", "act")
    other = os.open(log.path, os.O_RDWR)
    fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)  # raises where it is still locked
    for descriptor in (other, *inherited):
        os.close(descriptor)


def test_no_log_is_no_good_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NotFoundError):
        AuditLog(tmp_path).verify()
    assert main(["audit", "verify", "--data", str(tmp_path)]) == 1
    assert AUDIT_FILE in capsys.readouterr().err


def test_a_disk_that_takes_nothing_holds_nobody_up(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    trail = AuditTrail(AuditLog(tmp_path / "missing"))
    with trail.writing():
        for _ in range(3):
            trail.note("ann", "act")
    assert trail.lost == 3
    assert "could not be written" in caplog.text
