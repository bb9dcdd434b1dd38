"""Pages of docs/ that the service shows itself: all of them, installed too, with no markup but their own."""

import os
import re
import subprocess
import sys
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from shared_data import REPOSITORY
from tauscope.server.http.pages import load_chapters, render_chapter
from tauscope.server.problems import KINDS, TYPE_PREFIX


class Links(HTMLParser):
    """Everything that a page refers to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value or "" for name, value in attrs if name in ("href", "src")]


def sources() -> list[Path]:
    return [file for name in ("errors", "how-to") for file in (REPOSITORY / "docs" / name).glob("*.md")]


@pytest.fixture
def client(module_client: TestClient) -> TestClient:
    return module_client


@pytest.mark.parametrize("code", sorted(KINDS))
def test_the_type_of_a_problem_is_the_address_of_its_page(code: str, client: TestClient) -> None:
    answer = client.get(f"{TYPE_PREFIX}{code}")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    for words in (
        "<h2>What it means</h2>",
        "<h2>Examples</h2>",
        "<h2>What to do</h2>",
        f"<h1><code>{code}</code></h1>",
    ):
        assert words in answer.text
    assert f"HTTP status {int(KINDS[code].status)} " in answer.text


def test_every_page_is_shown_and_every_link_on_it_leads_somewhere(client: TestClient) -> None:
    written = {f"{file.parent.name}/{file.stem}" for file in sources()} - {"errors/README", "how-to/README"}
    assert set(load_chapters()) == written
    listed = Links(client.get("/docs").text).found
    for path in sorted(written):
        assert f"/docs/{path}" in listed
        answer = client.get(f"/docs/{path}")
        assert answer.status_code == 200
        assert not re.search(r"<script|<style|<img|\sstyle=|\son[a-z]+=", answer.text)
        for link in Links(answer.text).found:
            assert link.startswith("/"), (path, link)
            assert client.get(link).status_code == 200, (path, link)


def test_markup_stays_text_and_links_elsewhere_become_words() -> None:
    text = "# `x`\n<script>1</script> [a](b.md) [c](../how-to/d.md#e) [f](https://x.example) ![g](i.png)"
    page = render_chapter(text, "errors/x", {"errors/b": 0, "how-to/d": 0})
    assert page.title == "x"
    assert Links(page.html).found == ["/docs/errors/b", "/docs/how-to/d#e"]
    assert "&lt;script&gt;" in page.html
    assert "<img" not in page.html
    assert re.sub(r"<[^>]+>", "", page.html).split()[2:] == ["a", "c", "f"]


@pytest.mark.parametrize(
    "path", ["/docs/how-to/nothing", "/docs/how-to/README", "/docs/errors/README", "/docs/how-to/..%2fREADME"]
)
def test_there_are_no_other_pages(path: str, client: TestClient) -> None:
    assert client.get(path).status_code == 404


@pytest.mark.slow
def test_they_come_with_the_installed_package(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=REPOSITORY, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(tmp_path / "installed")
    assert not {"docs", "tests"} & {entry.name for entry in (tmp_path / "installed").iterdir()}
    tell = "from tauscope.server.http.pages import load_chapters; print(*load_chapters())"
    told = subprocess.run(
        [sys.executable, "-c", tell],
        cwd=tmp_path / "installed",
        env={**os.environ, "PYTHONPATH": "."},
        check=True,
        capture_output=True,
        text=True,
    )
    assert told.stdout.split() == list(load_chapters())
