"""Files appear complete or not at all."""

import os
import threading
from pathlib import Path

import pytest
import typer

from tauscope.cli.task_run import STANDARD_OUTPUT, require_distinct, require_free, write_file
from tauscope.errors import ExportError


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    path.write_text("old and much longer than the new text")
    write_file(path, "new ✓\n".encode())
    assert path.read_text(encoding="utf-8") == "new ✓\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.txt"]


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    target = tmp_path / "target.txt"
    target.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(target)
    write_file(link, b"new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_file(pipe, b"through")
    reader.join(timeout=10)
    assert read == ["through"]
    assert pipe.is_fifo()


def test_what_cannot_be_written_says_so_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    path = tmp_path / "out.txt"
    path.write_text("old")
    with pytest.raises(ExportError, match="No space left on device"):
        write_file(path, b"new")
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.txt"]


def test_a_dash_is_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    write_file(STANDARD_OUTPUT, b"text\n")
    assert capsys.readouterr().out == "text\n"


def test_nothing_is_written_into_a_folder_that_is_read(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    with pytest.raises(typer.BadParameter, match="never written to"):
        require_free([bag / "out.json"], [bag])


def test_a_name_with_dots_in_it_does_not_deceive(tmp_path: Path) -> None:
    recording = tmp_path / "a.csv"
    recording.touch()
    (tmp_path / "sub").mkdir()
    with pytest.raises(typer.BadParameter, match="never written to"):
        require_free([tmp_path / "sub" / ".." / "a.csv"], [recording])
    with pytest.raises(typer.BadParameter, match="twice"):
        require_distinct([recording, tmp_path / "sub" / ".." / "a.csv"])


def test_free_names_pass(tmp_path: Path) -> None:
    recording = tmp_path / "a.csv"
    recording.touch()
    require_free([tmp_path / "a.json", STANDARD_OUTPUT, STANDARD_OUTPUT], [recording])
    require_distinct([recording, tmp_path / "b.csv"])
