"""What the page says, read from its sources: the sentences in English, and the German ones beside them."""

import json
import re
from collections.abc import Iterator

from tauscope.server.page.router import STATIC

COMMENT = re.compile(r"^\s*(//|/?\*).*$", re.MULTILINE)
TAGGED = re.compile(r"(?<![\w.$])t`")
ENTRY = re.compile(r'^  (".*": ".*"),$', re.MULTILINE)


def sentences() -> set[str]:
    """All of the page's sentences, {0}, {1} … where the data decide."""
    scripts = [path for path in STATIC.glob("*.js") if path.name != "german.js"]
    return {found for path in scripts for found in tagged(COMMENT.sub("", path.read_text(encoding="utf-8")))}


def tagged(source: str) -> Iterator[str]:
    """Sentences of the templates t`…` of a script, those within a template's parts too.

    Parameters
    ----------
    source : str
        of the script
    """
    for match in TAGGED.finditer(source):
        yield _template(source, match.end())[0]


def _template(source: str, at: int) -> tuple[str, int]:
    """The sentence of a template that begins at a place, and where the template ends."""
    text, parts = "", 0
    while source[at] != "`":
        if source.startswith("${", at):
            text, parts, at = f"{text}{{{parts}}}", parts + 1, _part_end(source, at + 2)
        else:
            text, at = text + source[at], at + 1
    return text, at + 1


def _part_end(source: str, at: int) -> int:
    """Behind the brace that closes a part."""
    depth = 1
    while depth:
        if source[at] == "`":
            at = _template(source, at + 1)[1]
            continue
        depth += {"{": 1, "}": -1}.get(source[at], 0)
        at += 1
    return at


def german() -> tuple[dict[str, str], dict[str, str]]:
    """Sentences by the English ones, and names by the service's ids."""
    first, second = (STATIC / "german.js").read_text(encoding="utf-8").split("export const NAMES")
    return _entries(first), _entries(second)


def _entries(source: str) -> dict[str, str]:
    """Entries of an object that holds one on a line, none twice."""
    lines = ENTRY.findall(source)
    found = json.loads("{" + ",".join(lines) + "}")
    assert len(found) == len(lines)
    return found
