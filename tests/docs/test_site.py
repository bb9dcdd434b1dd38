"""The documentation site: its navigation is whole, its links lead on, and its generated pages hold all there is."""

from pathlib import Path

import pytest

import tauscope
from docs.site.cli_page import cli_page
from docs.site.links import find_faults
from docs.site.navigation import GENERATED, LINK, list_pages
from docs.site.python_page import python_page
from docs.site.rest_page import load_document, rest_page, schemas_page
from docs.site.sources import find_place, write_sources
from shared_data import REPOSITORY
from tauscope.cli.program import VERBS

PAGES = sorted(page.relative_to(REPOSITORY).as_posix() for page in REPOSITORY.glob("docs/**/*.md"))


def test_every_page_is_in_the_navigation_once() -> None:
    listed = list(list_pages())
    assert len(listed) == len(set(listed))
    assert set(PAGES) <= set(listed)


def test_every_entry_of_the_navigation_is_a_page() -> None:
    missing = [page for page in list_pages() if not (REPOSITORY / page).is_file()]
    assert missing == [*GENERATED]


def test_links_lead_on_where_the_pages_stand_on_the_site(tmp_path: Path) -> None:
    write_sources(tmp_path)
    places = {find_place(page) for page in list_pages()}
    assert {each.relative_to(tmp_path).as_posix() for each in tmp_path.rglob("*.md")} == places - {
        find_place(page) for page in GENERATED
    }
    for place in places - {find_place(page) for page in GENERATED}:
        page = tmp_path / place
        for target in LINK.findall(page.read_text(encoding="utf-8")):
            path = target.partition("#")[0]
            if path and ":" not in path:
                there = (page.parent / path).resolve()
                assert there.is_file() or there.relative_to(tmp_path.resolve()).as_posix() in places, (place, target)


def test_the_command_line_has_every_verb() -> None:
    page = cli_page()
    assert [verb for verb in VERBS if f"\n### `tauscope {verb}`\n" not in page] == []
    assert "--held-out RECORDING..." in page
    assert "\n### `tauscope bus scan`\n" in page


def test_the_rest_interface_has_every_operation_and_schema() -> None:
    document, operations, schemas = load_document(), rest_page(), schemas_page()
    for path, methods in document["paths"].items():
        for method in methods:
            assert f"\n### `{method.upper()} {path}`\n" in operations
    for name in document["components"]["schemas"]:
        assert f"\n## {name}\n" in schemas


def test_the_python_page_has_every_public_name() -> None:
    page = python_page()
    assert [name for name in tauscope.__all__ if f":: tauscope.{name}\n" not in page] == []
    for name in ("results.DiagnosisResult", "results.RolloutResult", "errors.RecordingError"):
        assert f":: tauscope.{name}\n" in page


@pytest.mark.parametrize(
    ("link", "fault"),
    [
        ('<a class="x" href="other.html#there">', None),
        ('<a href="#here">', None),
        ('<a href="https://example.org/">', None),
        ('<a href="other.html#gone">', "page.html: other.html#gone has no such anchor"),
        ('<a href="gone.html">', "page.html: gone.html leads nowhere"),
        ('<img alt="" src="gone.png">', "page.html: gone.png leads nowhere"),
        ('<script src="https://example.org/x.js">', "page.html: loads https://example.org/x.js"),
        ('<link rel="stylesheet" href="//example.org/x.css">', "page.html: loads //example.org/x.css"),
    ],
)
def test_the_check_of_links_finds_what_is_broken(link: str, fault: str | None, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(f'<p id="here">{link}</p>', encoding="utf-8")
    (tmp_path / "other.html").write_text('<h1 data-id="gone" id="there">', encoding="utf-8")
    assert list(find_faults(tmp_path)) == ([] if fault is None else [fault])
