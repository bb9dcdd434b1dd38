"""``tauscope key`` at the command line, and ``serve`` at an address that others can reach."""

from pathlib import Path

import pytest

from tauscope.cli.program import main
from tauscope.server.auth.keys import KeyFile, match_key


def test_a_key_from_its_making_to_its_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = ["--data", str(tmp_path / "data")]
    assert main(["key", "add", "night job", "--scope", "move", "--days", "30", *data]) == 0
    out, err = capsys.readouterr()
    (key,) = KeyFile(tmp_path / "data").read()
    assert match_key((key,), out.strip()) == key
    assert out.strip() not in err
    assert key.expires is not None
    assert (key.expires - key.created).days == 30
    assert main(["key", "list", *data]) == 0
    listed = capsys.readouterr().out
    assert listed.split()[:3] == [key.id, "move", "valid"]
    assert out.strip() not in listed
    assert main(["key", "revoke", "night job", *data]) == 0
    assert main(["key", "list", *data]) == 0
    assert "revoked" in capsys.readouterr().out
    assert main(["key", "revoke", "night job", *data]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_key_for_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["key", "add", "ann", "--days", "0", "--data", str(tmp_path)]) == 0
    (key,) = KeyFile(tmp_path).read()
    assert (key.expires, key.scope) == (None, "read")
    assert "for good" in capsys.readouterr().err


def test_wrong_usage(tmp_path: Path) -> None:
    assert main(["key", "add", "ann", "--scope", "root", "--data", str(tmp_path)]) == 2
    assert main(["key", "add", "ann", "--days", "-1", "--data", str(tmp_path)]) == 2


def test_no_service_without_keys_where_others_could_reach_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["serve", "--host", "0.0.0.0", "--port", "0", "--data", str(tmp_path)]) == 1
    *_, last = capsys.readouterr().err.strip().split("\n")
    assert "others could reach it" in last
    assert "tauscope key add" in last
