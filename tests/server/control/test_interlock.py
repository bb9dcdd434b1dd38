"""The hook that asks whether the arm is free: only a plain yes is a yes."""

from pathlib import Path

import pytest

from tauscope.server.schedules.scheduler import FOLDER, find_objection


def program(data: Path, text: str, mode: int = 0o755) -> Path:
    (data / FOLDER).mkdir(exist_ok=True)
    path = data / FOLDER / "free"
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(mode)
    return path


def ask(data: Path) -> str | None:
    return find_objection(data, "free", "arm 3", "arm 3 on sim")


def test_yes(tmp_path: Path) -> None:
    program(tmp_path, '[ "$1" = "arm 3" ] && [ "$2" = "arm 3 on sim" ]')
    assert ask(tmp_path) is None


def test_no_with_its_reason(tmp_path: Path) -> None:
    program(tmp_path, "echo 'part in the gripper'; echo more; exit 3")
    assert ask(tmp_path) == "interlock free: part in the gripper"
    program(tmp_path, "exit 3")
    assert ask(tmp_path) == "interlock free: exit status 3"
    program(tmp_path, "echo door open >&2; exit 1")
    assert ask(tmp_path) == "interlock free: door open"


def test_no_answer_is_a_no(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope.server.schedules.scheduler.TIMEOUT_S", 0.1)
    program(tmp_path, "exec sleep 30")
    assert ask(tmp_path) == "interlock free: did not answer within 0.1 s"


def test_what_is_no_program_of_the_operators_is_not_called(tmp_path: Path) -> None:
    assert "there is no program free" in (ask(tmp_path) or "")
    path = program(tmp_path, "exit 0", mode=0o777)
    assert "others may write to it" in (ask(tmp_path) or "")
    path.chmod(0o644)
    assert "is no program" in (ask(tmp_path) or "")
    path.unlink()
    path.symlink_to("/bin/true")
    assert "is no program" in (ask(tmp_path) or "")
    path.unlink()
    path.write_bytes(b"\0\1\2")
    path.chmod(0o755)
    assert "cannot be called" in (ask(tmp_path) or "")
