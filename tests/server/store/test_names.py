"""Names that may become paths."""

import re
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.server.store.files import FILE_NAME_PATTERN, is_file_name, is_identifier, new_identifier


@pytest.mark.parametrize("name", ["a.csv", "log 2026-11-03 b.csv", "_x", "run+1=2@home.mcap", "7"])
def test_ordinary_names(name: str) -> None:
    assert is_file_name(name)


HOSTILE = [
    "", ".", "..", "../a.csv", "a/b.csv", "/etc/passwd", "a\\b.csv", "C:\\a.csv", ".hidden", "-rf", " a", "a ", "a.",
    "a\0.csv", "a\n.csv", "a\r\nSet-Cookie: x.csv", "a;b", "$(x)", "`x`", "a|b", "a%2fb", "ü.csv", "a\u202etxt.csv",
    "a" * 129, "a.csv\n",
]  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names(name: str) -> None:
    assert not is_file_name(name)


@given(st.text(max_size=12))
def test_a_file_name_is_one_visible_component(name: str) -> None:
    if is_file_name(name):
        assert Path("/data", name).parent == Path("/data")
        assert Path("/data", name).resolve() == Path("/data", name)
        assert not name.startswith(".")
        assert name.isprintable()
        assert re.search(FILE_NAME_PATTERN, name)


def test_identifiers_are_sorted_by_time_whatever_the_zone() -> None:
    early = datetime(2026, 11, 3, 23, 30, tzinfo=timezone(timedelta(hours=2)))
    late = datetime(2026, 11, 3, 21, 31, tzinfo=UTC)
    assert new_identifier(early) < new_identifier(late)
    assert new_identifier(late) != new_identifier(late)
    assert is_identifier(new_identifier(early))


@pytest.mark.parametrize(
    "text", ["", "..", "20261103T213100Z-1f2e3d4", "20261103T213100Z-1f2e3d4c\n", "../20261103T213100Z-1f2e3d4c"]
)
def test_no_identifiers(text: str) -> None:
    assert not is_identifier(text)
