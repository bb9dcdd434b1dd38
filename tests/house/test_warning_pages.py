"""Every code of a warning has a page and a row, and every page a code."""

import re
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
PAGES = REPOSITORY / "docs" / "warnings"
CODE = re.compile(r"""code="([a-z-]+)"|^\s*(?:yield )?\(?"(?:q|effort)", "([a-z-]+)",""", re.MULTILINE)


def codes_of_recordings() -> set[str]:
    folder = REPOSITORY / "service" / "tauscope" / "recording"
    texts = [path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))]
    return {first or second for text in texts for first, second in CODE.findall(text)}


def test_every_code_has_a_page_and_a_row() -> None:
    codes = codes_of_recordings()
    assert {"time-stamps", "spikes", "encoder-reset", "doubtful-units"} <= codes
    rows = (PAGES / "README.md").read_text(encoding="utf-8")
    for code in codes:
        page = (PAGES / f"{code}.md").read_text(encoding="utf-8")
        assert page.startswith(f"# `{code}`\n")
        for heading in ("## What it means", "## Why it matters", "## What to do"):
            assert heading in page
        assert f"| [`{code}`]({code}.md) |" in rows


def test_every_page_has_a_row() -> None:
    rows = (PAGES / "README.md").read_text(encoding="utf-8")
    for page in PAGES.glob("*.md"):
        assert page.name == "README.md" or f"({page.name})" in rows
