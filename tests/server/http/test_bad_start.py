"""A service that cannot work says so in one line, and tells its address only when it works."""

from pathlib import Path

import pytest

from tauscope.cli import main
from tauscope.server.http import Settings
from tauscope.server.http.services import require_data_folder
from tauscope.server.store.database.database import FILE_NAME, Database

OWN = 0o077
"""Rights that only others have."""


@pytest.mark.parametrize("damage", ["header", "middle"])
def test_a_damaged_database_is_one_line(tmp_path: Path, damage: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / FILE_NAME
    Database(path).close()
    content = bytearray(path.read_bytes())
    start = 0 if damage == "header" else 4096
    content[start:] = b"garbage!" * ((len(content) - start) // 8)
    path.write_bytes(content)
    status = main(["serve", "--port", "0", "--data", str(tmp_path)])
    out, err = capfd.readouterr()
    assert (status, out) == (1, "")
    assert len(err.splitlines()) == 1, err
    assert f"{FILE_NAME}: is damaged" in err
    assert "restore a backup" in err


def test_what_is_made_is_for_its_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    require_data_folder(Settings(data_folder=folder))
    database = Database(folder / FILE_NAME)
    try:
        assert folder.stat().st_mode & OWN == 0
        assert [path.name for path in folder.glob(f"{FILE_NAME}*") if path.stat().st_mode & OWN] == []
    finally:
        database.close()
